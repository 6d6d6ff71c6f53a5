// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace berth::procedures {

/// error: the run could not pass; warning: it may not do what was meant; note: what was assumed.
enum class Severity { error, warning, note };
const char* name_of(Severity severity);

/// Something that a check has to say about a procedure.
struct Finding {
  Severity severity = Severity::error;
  std::string file;
  int line = 0;     ///< 0: of the whole file
  std::string key;  ///< step, criterion or key of the file
  std::string found;
  std::string expected;  ///< may be empty
  int step = -1;         ///< index among main steps, then teardown; -1: of none
};

/// "file:line: error: step 'move': found ..., expected ...".
std::string text_of(const Finding& finding);

/// Of an InputError's "file:line: key ...".
Finding finding_of_error(const std::string& what, const std::string& file);

bool has_errors(const std::vector<Finding>& findings);

}  // namespace berth::procedures
