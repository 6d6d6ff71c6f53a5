// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/modbus/modbus_image.h"

#include <new>

namespace berth {

ModbusImage::ModbusImage(int registers, int coils, int inputs)
    : mapping_(modbus_mapping_new(coils, inputs, registers, 0)) {
  if (!mapping_) throw std::bad_alloc();
}

}  // namespace berth
