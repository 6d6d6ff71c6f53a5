// SPDX-License-Identifier: BSD-3-Clause
#include "logs/inspect/repair.h"

#include "logs/file/derived_log.h"
#include "logs/types/value.h"

namespace berth::logs {

Repair repair(const std::filesystem::path& in, const std::filesystem::path& out,
              const TypeCatalogue& types) {
  constexpr std::int64_t most_findings = 100;
  LogReader reader(in);
  DerivedLog log(out);
  Repair result;
  LogEvent event;
  while (reader.next(event)) {
    const StructType* type = types.type_of(event.data);
    if (event.data.size() < 8 || (type != nullptr && !is_message(*type, event.data))) {
      if (result.dropped++ < most_findings) {
        result.findings.push_back({Finding::Kind::undecodable, event.offset, event.number,
                                   event.utime, std::string(event.channel), 1});
      }
    } else {
      log.writer().copy(event);
      ++result.written;
    }
  }
  for (const Damage& d : reader.damage()) {
    result.findings.push_back({Finding::Kind::damage, d.offset, d.after_event, d.after_utime, "",
                               static_cast<std::int64_t>(d.bytes)});
  }
  result.damaged_bytes = reader.damaged_bytes();
  log.finish();
  return result;
}

}  // namespace berth::logs
