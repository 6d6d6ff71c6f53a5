# SPDX-License-Identifier: BSD-3-Clause
find_path(MODBUS_INCLUDE_DIR modbus/modbus.h)
find_library(MODBUS_LIBRARY modbus)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Modbus REQUIRED_VARS MODBUS_LIBRARY MODBUS_INCLUDE_DIR)
if(Modbus_FOUND AND NOT TARGET Modbus::modbus)
  add_library(Modbus::modbus UNKNOWN IMPORTED)
  set_target_properties(Modbus::modbus PROPERTIES IMPORTED_LOCATION ${MODBUS_LIBRARY}
                        INTERFACE_INCLUDE_DIRECTORIES ${MODBUS_INCLUDE_DIR})
endif()
