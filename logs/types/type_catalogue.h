// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/bus/bus.h"
#include "logs/types/lcm_type.h"

namespace berth::logs {

/// Message types, found by the fingerprint with which every message begins.
class TypeCatalogue {
 public:
  /// A .lcm file, or all of a directory and those below it. Members' types are looked for there
  /// first, then among those that were added before; of types with one fingerprint the first stays.
  /// @throws InputError for what cannot be read, is no message type, or names a type that is not
  /// there.
  void add(const std::filesystem::path& path);
  /// The same from text; name stands in for the file in messages.
  void add_text(std::string_view text, const std::string& name);

  /// The type of these bytes; null when it is not known.
  const StructType* type_of(Bytes message) const;
  const StructType* by_fingerprint(std::uint64_t fingerprint) const;
  /// With its package; null when there is none.
  const StructType* by_name(const std::string& name) const;
  /// In the order in which they were added.
  const std::vector<std::unique_ptr<const StructType>>& types() const { return types_; }

 private:
  void add_types(std::vector<StructType> parsed);

  std::vector<std::unique_ptr<const StructType>> types_;
  std::unordered_map<std::uint64_t, const StructType*> by_fingerprint_;
  std::unordered_map<std::string, const StructType*> by_name_;
};

/// The fingerprint with which a message begins; 0 when it is too short for one.
std::uint64_t fingerprint_of(Bytes message);

}  // namespace berth::logs
