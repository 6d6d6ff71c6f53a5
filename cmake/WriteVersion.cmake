# SPDX-License-Identifier: BSD-3-Clause
# Writes version.cpp, only if it changed.
execute_process(COMMAND git describe --always --dirty --exclude=* WORKING_DIRECTORY ${SOURCE}
                OUTPUT_VARIABLE revision OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(revision)
  set(VERSION "${VERSION}+${revision}")
endif()
set(content "// SPDX-License-Identifier: BSD-3-Clause
#include \"common/core/version.h\"
const char* berth::version() { return \"${VERSION}\"; }
")
if(EXISTS ${OUTPUT})
  file(READ ${OUTPUT} previous)
endif()
if(NOT "${content}" STREQUAL "${previous}")
  file(WRITE ${OUTPUT} "${content}")
endif()
