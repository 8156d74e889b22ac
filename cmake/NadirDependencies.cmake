# What must be there, and what may be missing. `cmake/setup.sh deps` installs all of it.
list(APPEND CMAKE_MODULE_PATH /usr/share/cmake/geographiclib)  # where Debian keeps FindGeographicLib.cmake

find_package(GDAL 3.6 REQUIRED)
find_package(Eigen3 3.4 REQUIRED)
find_package(TBB REQUIRED)
find_package(GeographicLib REQUIRED)
find_package(fmt REQUIRED)
find_package(tl-expected REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 QUIET)
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

# nadir_optional(<option> <description> <what is missing, empty when all is there>)
# An optional part: on where its dependencies are, off with a message where one is missing.
function(nadir_optional option description missing)
  option(${option} "${description}" ON)
  if(${option} AND missing)
    message(STATUS "${option}: off, ${missing} not found (${description})")
    set(${option} OFF PARENT_SCOPE)
  endif()
endfunction()

set(missing)
find_package(OpenImageIO QUIET)
find_package(Freetype QUIET)
if(NOT OpenImageIO_FOUND)
  set(missing OpenImageIO)
elseif(NOT Freetype_FOUND)
  set(missing FreeType)
endif()
nadir_optional(NADIR_IMAGES "image files: frames, contact sheets and maps with footprints" "${missing}")

set(missing)
if(NOT CLI11_FOUND)
  set(missing CLI11)
endif()
nadir_optional(NADIR_COMMANDS "the nadir command" "${missing}")

set(missing)
find_package(GTest QUIET)
if(NOT GTest_FOUND)
  set(missing GoogleTest)
endif()
nadir_optional(NADIR_TESTS "the tests" "${missing}")

set(missing)
find_package(benchmark QUIET)
if(NOT benchmark_FOUND)
  set(missing "Google Benchmark")
endif()
nadir_optional(NADIR_BENCH "the benchmarks" "${missing}")

find_package(OpenCV QUIET COMPONENTS core imgproc)  # a peer in tests and benchmarks, never in the libraries
