# Highway, which vector kernels are written in: of the build, and of programs that use installed libraries built with it.
if(NOT TARGET nadir_highway)
  find_package(PkgConfig REQUIRED)
  pkg_check_modules(NADIR_HIGHWAY QUIET IMPORTED_TARGET libhwy)
  if(NADIR_HIGHWAY_FOUND)
    add_library(nadir_highway INTERFACE IMPORTED)
    target_link_libraries(nadir_highway INTERFACE PkgConfig::NADIR_HIGHWAY)
  endif()
endif()
