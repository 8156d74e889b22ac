include(GNUInstallDirs)

# How every target of this project is compiled. Nothing here is set globally but the output folder.
option(NADIR_WARNINGS_AS_ERRORS "Stop at warnings" OFF)
option(NADIR_LTO "Optimise vehicles' motion across libraries where a program is linked (GCC, releases)" ON)
option(NADIR_FUZZ "Build the fuzz targets, which need clang: see the preset" OFF)
set(NADIR_SANITIZE "" CACHE STRING "Sanitizers to build with, for instance address,undefined")

if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)  # the image module and other people's shared libraries take our archives in

# All programs lie side by side, since `nadir X` runs the program `nadir-X` beside it.
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR})

find_program(NADIR_CCACHE ccache)
if(NADIR_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${NADIR_CCACHE})
endif()

add_library(nadir_options INTERFACE)
target_compile_features(nadir_options INTERFACE cxx_std_20)
# Fused multiply-add would make results differ between CPUs: the same steps must give the same bits. Nobody replaces
# single functions of ours by others, so that calls within a file may be inlined in position-independent code too.
target_compile_options(nadir_options INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Wno-missing-field-initializers
                       -ffp-contract=off -fno-semantic-interposition)
if(NADIR_WARNINGS_AS_ERRORS)
  target_compile_options(nadir_options INTERFACE -Werror)
endif()
if(NADIR_SANITIZE)
  target_compile_options(nadir_options INTERFACE -fsanitize=${NADIR_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(nadir_options INTERFACE -fsanitize=${NADIR_SANITIZE})
endif()

# nadir_library(<name> SOURCES <files> HEADERS <public headers> [PUBLIC <libs>] [PRIVATE <libs>])
# A static library nadir_<name>, known as nadir::<name>, whose public headers lie in include/.
function(nadir_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;HEADERS;PUBLIC;PRIVATE" ${ARGN})
  add_library(nadir_${name} STATIC ${ARG_SOURCES})
  add_library(nadir::${name} ALIAS nadir_${name})
  target_sources(nadir_${name} PUBLIC FILE_SET HEADERS BASE_DIRS include FILES ${ARG_HEADERS})
  target_compile_features(nadir_${name} PUBLIC cxx_std_20)
  target_link_libraries(nadir_${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:nadir_options>)
  set_target_properties(nadir_${name} PROPERTIES EXPORT_NAME ${name})
  set_property(GLOBAL APPEND PROPERTY NADIR_LIBRARIES nadir_${name})
endfunction()

# nadir_optimise_at_link(<targets>): libraries whose small functions call one another, and programs for which that counts.
# Objects stay whole, so that all others link them as ever.
function(nadir_optimise_at_link)
  if(NOT NADIR_LTO OR NADIR_SANITIZE OR NOT CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    return()
  endif()
  foreach(target IN LISTS ARGN)
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-flto=auto;-ffat-lto-objects>)
    target_link_options(${target} PRIVATE $<$<CONFIG:Release>:-flto=auto>)
  endforeach()
endfunction()

# nadir_program(<name> SOURCES <files> LIBS <libs>): a program in the build folder, installed to bin.
function(nadir_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_LIBS} nadir_options)
  add_dependencies(${name} nadir_gdal_module)  # which it may load
  install(TARGETS ${name} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endfunction()
