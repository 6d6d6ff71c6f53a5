// SPDX-License-Identifier: BSD-3-Clause
#include "common/clouds/cloud_builder.h"
#include "common/clouds/cloud_formats.h"
#include "common/files/ply_reader.h"

namespace berth::clouds {

Cloud parse_ply(std::string_view bytes, const std::string& file, const CloudOptions& options) {
  files::PlyReader ply(bytes, file);
  const files::PlyElement* const vertices = ply.find("vertex");
  if (vertices == nullptr) throw InputError(file + ": found no element 'vertex'");
  if (vertices->count == 0) throw InputError(file + ": holds no point");
  std::vector<std::string> names;
  std::string found;
  for (const files::PlyProperty& property : vertices->properties) {
    names.push_back(property.is_list ? "" : property.name);
    found += (found.empty() ? "" : " ") + property.name;
  }
  const Columns columns = find_columns(names, file);
  if (!columns.has_point()) {
    throw InputError(file + ": found the fields '" + found + "', expected x, y and z among them");
  }
  CloudBuilder cloud(columns, options);
  while (ply.next()) {
    if (&ply.element() != vertices) continue;
    CloudRow row;
    row.point = {ply.value(columns.x.index), ply.value(columns.y.index),
                 ply.value(columns.z.index)};
    if (columns.sigma) row.sigma = ply.value(columns.sigma.index);
    if (columns.return_number) row.return_number = ply.value(columns.return_number.index);
    if (columns.time) row.time = ply.value(columns.time.index);
    cloud.add(row);
  }
  return cloud.finish();
}

}  // namespace berth::clouds
