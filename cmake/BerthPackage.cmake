# SPDX-License-Identifier: BSD-3-Clause
# What is installed beside the programs, and the Debian package: docs/install.md.

# The programs find these in ../share/berth. The configuration is installed whole: its hash, which every run records, is
# that of the sources.
foreach(directory config schemas targets)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/${directory} DESTINATION ${CMAKE_INSTALL_DATADIR}/berth)
endforeach()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/procedures DESTINATION ${CMAKE_INSTALL_DATADIR}/berth
        FILES_MATCHING PATTERN "*.yaml" PATTERN "schema.json"
        PATTERN "check" EXCLUDE PATTERN "engine" EXCLUDE PATTERN "language" EXCLUDE)

# Documents lie as in the sources, where the programs' messages and the documents themselves say that they are.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES ${PROJECT_SOURCE_DIR}/README.md ${PROJECT_SOURCE_DIR}/CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright)
foreach(protocol app/console drivers/lidar)
  install(FILES ${PROJECT_SOURCE_DIR}/${protocol}/PROTOCOL.md DESTINATION ${CMAKE_INSTALL_DOCDIR}/${protocol})
endforeach()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples DESTINATION ${CMAKE_INSTALL_DOCDIR})

# Of the packages that programs need when they run, libraries are found by dpkg-shlibdeps; these are not.
file(STRINGS ${PROJECT_SOURCE_DIR}/cmake/packages/run run_packages REGEX "^[a-z]")
list(TRANSFORM run_packages REPLACE "[ \t]*#.*" "")
list(JOIN run_packages ", " run_packages)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "The Berth authors <berth@localhost>" CACHE STRING "Maintainer of the Debian package")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_NAME berth)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "${run_packages}")
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/debian/prerm)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION "hardware-in-the-loop testbed for satellite docking
Two robot arms, one with a scaled satellite replica, the other with a
scanning LIDAR, and a model based pose estimator in open or closed loop,
with ground truth logged beside every estimate, and scripted procedures that
judge themselves. Runs without any hardware on a simulated cell.
.
Needs a processor with AVX2 (x86-64-v3). The units of a nightly run are
installed, not enabled.")
include(CPack)
