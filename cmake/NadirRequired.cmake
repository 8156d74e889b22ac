# What every build and every program that uses the installed libraries needs: the package file includes this too.
list(APPEND CMAKE_MODULE_PATH /usr/share/cmake/geographiclib)  # where Debian keeps FindGeographicLib.cmake

find_package(GDAL 3.6 REQUIRED)
find_package(Eigen3 3.4 REQUIRED)
find_package(TBB REQUIRED)
find_package(GeographicLib REQUIRED)
find_package(fmt REQUIRED)
find_package(tl-expected REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)
find_library(XXHASH_LIBRARY xxhash REQUIRED)
find_path(XXHASH_INCLUDE_DIR xxhash.h REQUIRED)
add_library(nadir_xxhash INTERFACE IMPORTED)
target_include_directories(nadir_xxhash INTERFACE ${XXHASH_INCLUDE_DIR})
target_link_libraries(nadir_xxhash INTERFACE ${XXHASH_LIBRARY})

if(NOT TARGET GeographicLib::GeographicLib)
  add_library(GeographicLib::GeographicLib INTERFACE IMPORTED)
  target_include_directories(GeographicLib::GeographicLib INTERFACE ${GeographicLib_INCLUDE_DIRS})
  target_link_libraries(GeographicLib::GeographicLib INTERFACE ${GeographicLib_LIBRARIES})
endif()
if(NOT TARGET yaml-cpp::yaml-cpp)  # version 0.7 exports the bare name
  add_library(yaml-cpp::yaml-cpp ALIAS yaml-cpp)
endif()

# What tiles are packed with, each by its own library.
find_package(PkgConfig REQUIRED)
pkg_check_modules(NADIR_CODECS REQUIRED IMPORTED_TARGET libdeflate libzstd liblzma libjpeg libwebp Lerc)
if(NOT TARGET nadir_codecs)
  add_library(nadir_codecs INTERFACE IMPORTED)
  target_link_libraries(nadir_codecs INTERFACE PkgConfig::NADIR_CODECS)
endif()

find_package(pugixml REQUIRED)
if(NOT TARGET nadir_pugixml)
  add_library(nadir_pugixml INTERFACE IMPORTED)
  target_link_libraries(nadir_pugixml INTERFACE pugixml)
endif()
