// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace berth::clouds {

enum class PclFormat { pcd, ply };

/// What a file's header is worth.
enum class PclHeader {
  unsound,  ///< damaged, or promises more than the file can hold
  text,     ///< of words, which the library takes for 0 where they are no numbers
  sound,
};

/// A file as the Point Cloud Library reads it: rows of fields.
struct PclTable {
  enum class Type { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };
  struct Field {
    std::string name;
    std::size_t offset = 0;  ///< in a row
    Type type = Type::float64;
  };

  std::vector<Field> fields;
  std::size_t width = 0;
  std::size_t height = 0;
  std::size_t row_bytes = 0;
  std::vector<std::uint8_t> bytes;
  bool has_viewpoint = false;  ///< other than the sensor's own
};

/// What the module libberth_pcl.so offers, under these names. Neither throws: why says what the
/// library threw.
extern "C" {
PclHeader berth_pcl_header(const std::string& file, PclFormat format, std::string& why);
/// @return whether the file could be read. Only after its header was found good.
bool berth_pcl_read(const std::string& file, PclFormat format, PclTable& table, std::string& why);
}

}  // namespace berth::clouds
