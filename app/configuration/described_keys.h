// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/configuration/kinds.h"
#include "common/core/config_recorder.h"
#include "common/core/table.h"

namespace berth {

/// A key of a kind of file, with the reader's description and the shipped files' comments.
struct DescribedKey {
  ConfigKey key;
  std::string meaning;
};

/// All keys that the reader of a kind reads for the shipped files, in the order of their sections.
/// Values are those of `file`, where one is given. @throws InputError.
std::vector<DescribedKey> described_keys(const ConfigKind& kind,
                                         const std::filesystem::path& file = {});

/// Key, unit or kind, default, what is allowed and meaning; values where there is a file.
Table key_table(const std::vector<DescribedKey>& keys, bool with_values);

/// JSON Schema (draft 2020-12), for editors.
std::string key_schema(const ConfigKind& kind, const std::vector<DescribedKey>& keys);

/// The tables of all kinds, in Markdown: the content of docs/configuration.md.
std::string document_of_keys();

}  // namespace berth
