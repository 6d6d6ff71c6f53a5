// SPDX-License-Identifier: BSD-3-Clause
#include "logs/types/type_catalogue.h"

#include <algorithm>

#include "common/core/error.h"
#include "common/core/file.h"
#include "logs/types/lcm_parser.h"
#include "logs/types/lcm_type.h"

namespace berth::logs {
namespace {

namespace fs = std::filesystem;

/// As the generated _computeHash(): a type within itself counts for nothing.
std::uint64_t hash_of(const StructType& type, std::vector<const StructType*>& parents) {
  if (std::find(parents.begin(), parents.end(), &type) != parents.end()) return 0;
  parents.push_back(&type);
  std::uint64_t hash = type.base_hash;
  for (const Field& field : type.fields) {
    if (field.structure != nullptr) hash += hash_of(*field.structure, parents);
  }
  parents.pop_back();
  return (hash << 1) + (hash >> 63);
}

std::optional<std::size_t> fixed_bytes_of(const StructType& type,
                                          std::vector<const StructType*>& parents) {
  if (std::find(parents.begin(), parents.end(), &type) != parents.end()) return std::nullopt;
  parents.push_back(&type);
  std::size_t sum = 0;
  for (const Field& field : type.fields) {
    std::optional<std::size_t> each = wire::bytes_of(field.kind);
    if (field.kind == Kind::structure) each = fixed_bytes_of(*field.structure, parents);
    if (!each) return std::nullopt;
    std::size_t bytes = *each;
    for (const Dimension& dimension : field.dimensions) {
      if (dimension.count_field >= 0) return std::nullopt;
      if (__builtin_mul_overflow(bytes, static_cast<std::size_t>(dimension.length), &bytes)) {
        return std::nullopt;
      }
    }
    if (__builtin_add_overflow(sum, bytes, &sum)) return std::nullopt;
  }
  parents.pop_back();
  return sum;
}

}  // namespace

std::uint64_t fingerprint_of(Bytes message) {
  return message.size() < 8 ? 0 : wire::unsigned_of<8>(message.data());
}

void TypeCatalogue::add(const fs::path& path) {
  std::vector<fs::path> files;
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    for (const auto& entry : fs::recursive_directory_iterator(path)) {
      if (entry.path().extension() == ".lcm" && entry.is_regular_file()) {
        files.push_back(entry.path());
      }
    }
    std::sort(files.begin(), files.end());
    if (files.empty()) throw InputError(path.string() + ": found no .lcm file in it");
  } else {
    files.push_back(path);
  }
  std::vector<StructType> parsed;
  for (const fs::path& file : files) {
    for (StructType& type : parse_lcm(read_file(file), file.string())) {
      parsed.push_back(std::move(type));
    }
  }
  add_types(std::move(parsed));
}

void TypeCatalogue::add_text(std::string_view text, const std::string& name) {
  add_types(parse_lcm(text, name));
}

void TypeCatalogue::add_types(std::vector<StructType> parsed) {
  std::vector<std::unique_ptr<StructType>> added;
  std::unordered_map<std::string, const StructType*> names = by_name_;
  for (StructType& type : parsed) {
    const StructType* before = by_name_.contains(type.name) ? nullptr : names[type.name];
    if (before != nullptr) {
      throw InputError(type.source + ": found a second type " + type.name + ", the first is at " +
                       before->source);
    }
    added.push_back(std::make_unique<StructType>(std::move(type)));
    names[added.back()->name] = added.back().get();
  }
  for (const auto& type : added) {
    for (Field& field : type->fields) {
      if (field.kind != Kind::structure) continue;
      const auto found = names.find(field.type_name);
      if (found == names.end()) {
        throw InputError(type->source + ": found '" + field.type_name + " " + field.name +
                         "', expected a type whose .lcm file is given too");
      }
      field.structure = found->second;
    }
  }
  std::vector<const StructType*> parents;
  for (const auto& type : added) {
    type->fingerprint = hash_of(*type, parents);
    parents.clear();
    type->fixed_bytes = fixed_bytes_of(*type, parents);
    parents.clear();
  }
  for (auto& type : added) {
    by_fingerprint_.try_emplace(type->fingerprint, type.get());
    by_name_.try_emplace(type->name, type.get());
    types_.push_back(std::move(type));
  }
}

const StructType* TypeCatalogue::type_of(Bytes message) const {
  return message.size() < 8 ? nullptr : by_fingerprint(fingerprint_of(message));
}

const StructType* TypeCatalogue::by_fingerprint(std::uint64_t fingerprint) const {
  const auto found = by_fingerprint_.find(fingerprint);
  return found == by_fingerprint_.end() ? nullptr : found->second;
}

const StructType* TypeCatalogue::by_name(const std::string& name) const {
  const auto found = by_name_.find(name);
  return found == by_name_.end() ? nullptr : found->second;
}

}  // namespace berth::logs
