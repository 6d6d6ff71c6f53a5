// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/check/finding.h"

#include <algorithm>

namespace berth::procedures {

const char* name_of(Severity severity) {
  switch (severity) {
    case Severity::error:
      return "error";
    case Severity::warning:
      return "warning";
    default:
      return "note";
  }
}

std::string text_of(const Finding& finding) {
  std::string text = finding.file;
  if (finding.line > 0) text += ":" + std::to_string(finding.line);
  text += std::string(": ") + name_of(finding.severity) + ": ";
  if (!finding.key.empty()) text += finding.key + ": ";
  text += finding.found;
  if (!finding.expected.empty()) text += "; expected " + finding.expected;
  return text;
}

Finding finding_of_error(const std::string& what, const std::string& file) {
  Finding finding;
  finding.file = file;
  finding.found = what;
  // the file named may be another one: that of a procedure called
  const auto digits = what.find_first_of("0123456789", what.find(':'));
  const auto colon = what.find(": ");
  if (colon == std::string::npos || digits == std::string::npos || digits > colon) return finding;
  const auto before = what.rfind(':', colon - 1);
  if (before == std::string::npos) return finding;
  const std::string number = what.substr(before + 1, colon - before - 1);
  if (number.empty() || number.size() > 9 ||
      number.find_first_not_of("0123456789") != std::string::npos) {
    return finding;
  }
  finding.file = what.substr(0, before);
  finding.line = std::stoi(number);
  finding.found = what.substr(colon + 2);
  return finding;
}

bool has_errors(const std::vector<Finding>& findings) {
  return std::any_of(findings.begin(), findings.end(),
                     [](const Finding& f) { return f.severity == Severity::error; });
}

}  // namespace berth::procedures
