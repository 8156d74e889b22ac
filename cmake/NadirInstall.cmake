# `cmake --install` gives other projects find_package(Nadir) and the targets nadir::renderer and below.
include(CMakePackageConfigHelpers)

set(NADIR_MODULE_DIR ${CMAKE_INSTALL_LIBDIR}/nadir)
set(NADIR_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/Nadir)
get_property(libraries GLOBAL PROPERTY NADIR_LIBRARIES)
install(TARGETS ${libraries} EXPORT Nadir ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} FILE_SET HEADERS)
install(EXPORT Nadir NAMESPACE nadir:: DESTINATION ${NADIR_PACKAGE_DIR} FILE NadirTargets.cmake)
configure_package_config_file(cmake/NadirConfig.cmake.in NadirConfig.cmake INSTALL_DESTINATION ${NADIR_PACKAGE_DIR}
  PATH_VARS NADIR_MODULE_DIR)
write_basic_package_version_file(NadirConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/NadirConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/NadirConfigVersion.cmake
  cmake/NadirRequired.cmake cmake/NadirHighway.cmake DESTINATION ${NADIR_PACKAGE_DIR})
