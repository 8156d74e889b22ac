# Installs the build, builds the consumer against it from outside, runs it: cmake -DBUILD=... -DSOURCE=... -DWORK=... -P run.cmake
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE failed OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(failed)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${command}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
run(${CMAKE_COMMAND} -G Ninja -S ${SOURCE}/tests/consumer -B ${WORK}/build -DCMAKE_PREFIX_PATH=${WORK}/prefix
  -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS=${FLAGS})
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/consumer ${SOURCE}/sim/demo/maps/kampala.tif ${SOURCE}/sim/demo/runs/rgb.yaml)
message("${output}")
# 100 m above the middle, nose to the east: the image's top left is 36 m ahead and 64 m to the north.
if(NOT output MATCHES "mean 13[0-9][.][0-9]+ valid (0[.]99[0-9]|1[.]000) top_left 0[.]35145[0-9]+ 32[.]59504[0-9]+")
  message(FATAL_ERROR "unexpected: ${output}")
endif()
# What is loaded when it is needed, if ever: GDAL and PROJ with the first raster that needs them.
run(readelf -d ${WORK}/build/consumer)
foreach(library OpenImageIO opencv ros curl gdal proj)
  if(output MATCHES "NEEDED.*lib${library}")
    message(FATAL_ERROR "a program that renders links ${library}")
  endif()
endforeach()
run(${WORK}/prefix/bin/nadir info ${SOURCE}/sim/demo/maps/naip_2010.tif)
# A map that needs GDAL, whose module a program outside finds along its run path
run(${WORK}/build/consumer ${SOURCE}/sim/demo/maps/naip_2010.tif ${SOURCE}/sim/demo/runs/rgb.yaml)
