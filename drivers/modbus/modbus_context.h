// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <modbus/modbus.h>

#include <memory>

namespace berth {

/// libmodbus' own state, freed with its holder. The sockets are ours.
struct ModbusContextDeleter {
  void operator()(modbus_t* context) const { modbus_free(context); }
};
using ModbusContext = std::unique_ptr<modbus_t, ModbusContextDeleter>;

/// @throws std::bad_alloc.
ModbusContext make_modbus_context();

}  // namespace berth
