# The CUDA back end, where a CUDA toolkit is found. WIDESTEREO_CUDA: AUTO (build it where nvcc is found), ON (fail
# without), OFF. A program with it starts and runs without an NVIDIA driver: the CUDA runtime is linked statically
# and opens the driver when first used.
set(WIDESTEREO_CUDA AUTO CACHE STRING "Build the CUDA back end: AUTO, ON or OFF")
set_property(CACHE WIDESTEREO_CUDA PROPERTY STRINGS AUTO ON OFF)

set(WIDESTEREO_HAS_CUDA FALSE)
set(cuda_summary "no (WIDESTEREO_CUDA=OFF)")
if(WIDESTEREO_CUDA)
  if(NOT CMAKE_CUDA_COMPILER AND NOT DEFINED ENV{CUDACXX})
    find_program(WIDESTEREO_NVCC nvcc HINTS ENV CUDA_PATH ENV CUDA_HOME PATH_SUFFIXES bin PATHS /usr/local/cuda)
    mark_as_advanced(WIDESTEREO_NVCC)
    if(WIDESTEREO_NVCC)
      set(ENV{CUDACXX} ${WIDESTEREO_NVCC})  # so that check_language() tries whether it works
    endif()
  endif()
  include(CheckLanguage)
  check_language(CUDA)
  set(least_cuda 11.8)
  # Asked first: older ones do not know the architectures, which enable_language() tries.
  set(nvcc_is_new_enough FALSE)
  if(CMAKE_CUDA_COMPILER)
    execute_process(COMMAND ${CMAKE_CUDA_COMPILER} --version OUTPUT_VARIABLE nvcc_version ERROR_QUIET)
    # clang, which takes other options, has no release.
    if(nvcc_version MATCHES "release ([0-9.]+)" AND CMAKE_MATCH_1 VERSION_GREATER_EQUAL ${least_cuda})
      set(nvcc_is_new_enough TRUE)
    endif()
  endif()
  if(nvcc_is_new_enough)
    # Before CMake's own default: from Turing to Hopper, and later ones through PTX. So may Orin (8.7), for which machine
    # code of other cards need not run.
    if(NOT DEFINED CMAKE_CUDA_ARCHITECTURES AND NOT DEFINED ENV{CUDAARCHS})
      set(CMAKE_CUDA_ARCHITECTURES 75-real 80 86-real 89-real 90 CACHE STRING
          "CUDA architectures")
    endif()
    enable_language(CUDA)
    find_package(CUDAToolkit ${least_cuda})
  endif()
  if(nvcc_is_new_enough AND CUDAToolkit_FOUND)
    set(WIDESTEREO_HAS_CUDA TRUE)
    string(REPLACE ";" " " architectures "${CMAKE_CUDA_ARCHITECTURES}")
    set(cuda_summary "yes, toolkit ${CUDAToolkit_VERSION}, architectures ${architectures}")
  elseif(WIDESTEREO_CUDA STREQUAL "AUTO")
    set(cuda_summary "no (no working nvcc of a CUDA toolkit of at least ${least_cuda} found; CMAKE_CUDA_COMPILER may name one)")
  else()
    message(FATAL_ERROR "WIDESTEREO_CUDA is ON, but no working nvcc of a CUDA toolkit of at least ${least_cuda} was found; "
                        "install one or set CMAKE_CUDA_COMPILER to it.")
  endif()
endif()
message(STATUS "CUDA back end: ${cuda_summary}")

file(GLOB cuda_sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/cuda/*.cpp)
if(WIDESTEREO_HAS_CUDA)
  list(REMOVE_ITEM cuda_sources ${PROJECT_SOURCE_DIR}/src/cuda/without_cuda.cpp)
  file(GLOB kernel_sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/cuda/*.cu)
  list(APPEND cuda_sources ${kernel_sources})
else()
  set(cuda_sources ${PROJECT_SOURCE_DIR}/src/cuda/without_cuda.cpp ${PROJECT_SOURCE_DIR}/src/cuda/architectures.cpp
      ${PROJECT_SOURCE_DIR}/src/cuda/peaks.cpp)
endif()
add_library(widestereo_cuda OBJECT ${cuda_sources})
target_link_libraries(widestereo_cuda PUBLIC widestereo_settings)
list(APPEND component_targets widestereo_cuda)

if(WIDESTEREO_HAS_CUDA)
  # C++17, which CUDA 11 knows. Kernels for the presets' constants may contract to fused multiply-add and divide as
  # Vulkan drivers do, to 2 units in the last place, which saves instructions. The generic kernels, which exact
  # filtering runs, and the maps' conversions must give the host's bits.
  set_target_properties(widestereo_cuda PROPERTIES CUDA_STANDARD 17 CUDA_STANDARD_REQUIRED ON
                        CUDA_RUNTIME_LIBRARY Static)
  target_compile_options(widestereo_cuda PRIVATE
    "$<$<COMPILE_LANGUAGE:CUDA>:-Xcompiler=-Wall;-Xfatbin=-compress-all>")
  if(WIDESTEREO_WARNINGS_AS_ERRORS)
    target_compile_options(widestereo_cuda PRIVATE
      "$<$<COMPILE_LANGUAGE:CUDA>:-Werror=all-warnings;-Xcompiler=-Werror>")
  endif()
  set_source_files_properties(${kernel_sources} PROPERTIES
                              COMPILE_OPTIONS "-ftz=true;-prec-div=false;-prec-sqrt=false")
  set_source_files_properties(${PROJECT_SOURCE_DIR}/src/cuda/convert_maps.cu
                              ${PROJECT_SOURCE_DIR}/src/cuda/kernels_generic.cu PROPERTIES COMPILE_OPTIONS -fmad=false)
  set_source_files_properties(${PROJECT_SOURCE_DIR}/src/cuda/architectures.cpp PROPERTIES COMPILE_DEFINITIONS
                              "WIDESTEREO_CUDA_ARCHITECTURES=\"${architectures}\"")
  target_compile_definitions(widestereo_cuda PUBLIC WIDESTEREO_HAS_CUDA)
  target_link_libraries(widestereo_cuda PUBLIC CUDA::cudart_static)
endif()
