// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "logs/types/value.h"

namespace berth::logs {

/// How a type's messages become rows: learnt from all of them, as arrays have a size of their own
/// in each.
class CsvColumns {
 public:
  explicit CsvColumns(const StructType& type);

  /// Call for every message, then settle() once, then header() and rows().
  void learn(const Value& message) { learn(type_, message, shape_); }
  void settle();

  std::string header() const;
  /// One line, or one for each entry; each begins with prefix.
  void rows(const Value& message, const std::string& prefix, std::string& out,
            std::int64_t& count) const;

 private:
  /// Greatest length of each dimension of each field, and of what is within.
  struct Shape {
    std::vector<std::vector<std::size_t>> lengths;
    std::vector<std::unique_ptr<Shape>> within;
  };
  static void prepare(const StructType& type, Shape& shape);
  static void learn(const StructType& type, const Value& value, Shape& shape);
  static void learn_array(const Field& field, const Value& value, std::size_t dimension,
                          std::vector<std::size_t>& lengths, Shape* within);
  void names(const StructType& type, const Shape& shape, const std::string& prefix, bool top,
             std::string& out) const;
  void array_names(const Field& field, const std::vector<std::size_t>& lengths, const Shape* within,
                   std::size_t dimension, const std::string& name, std::string& out) const;
  void cells(const StructType& type, const Shape& shape, const Value* value, bool top,
             std::size_t entry, std::string& out) const;
  void array_cells(const Field& field, const std::vector<std::size_t>& lengths, const Shape* within,
                   std::size_t dimension, const Value* value, std::string& out) const;
  /// Of the field that is spread over rows.
  bool is_long(const Field& field, bool top) const;

  const StructType& type_;
  Shape shape_;
  int long_count_ = -1;  ///< index of the field that tells how many entries; -1: a row a message
};

}  // namespace berth::logs
