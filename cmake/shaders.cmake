# Compiles the kernels to SPIR-V, optimises and validates them where the tools exist, and embeds them in
# widestereo_vulkan. Only the Vulkan headers are needed: the loader is opened at run time.
find_path(WIDESTEREO_VULKAN_HEADERS vulkan/vulkan.h HINTS $ENV{VULKAN_SDK}/include)
find_program(WIDESTEREO_GLSLANG glslangValidator HINTS $ENV{VULKAN_SDK}/bin)
find_program(WIDESTEREO_SPIRV_OPT spirv-opt HINTS $ENV{VULKAN_SDK}/bin)
find_program(WIDESTEREO_SPIRV_VAL spirv-val HINTS $ENV{VULKAN_SDK}/bin)
mark_as_advanced(WIDESTEREO_VULKAN_HEADERS WIDESTEREO_GLSLANG WIDESTEREO_SPIRV_OPT WIDESTEREO_SPIRV_VAL)
if(NOT WIDESTEREO_VULKAN_HEADERS)
  message(FATAL_ERROR "The Vulkan headers are missing; install libvulkan-dev.")
endif()
if(NOT WIDESTEREO_GLSLANG)
  message(FATAL_ERROR "glslangValidator is missing; install glslang-tools.")
endif()
if(NOT WIDESTEREO_SPIRV_OPT OR NOT WIDESTEREO_SPIRV_VAL)
  message(STATUS "spirv-opt or spirv-val not found (package spirv-tools): shaders are built without")
endif()

set(WIDESTEREO_SPIRV_TARGET vulkan1.1)
set(shader_folder ${PROJECT_SOURCE_DIR}/shaders)
set(spirv_folder ${PROJECT_BINARY_DIR}/shaders)
file(MAKE_DIRECTORY ${spirv_folder})

set(spirv_modules)
# The module `name` is `source`, compiled with further definitions.
function(widestereo_module name source)
  set(module ${spirv_folder}/${name}.spv)
  set(steps COMMAND ${WIDESTEREO_GLSLANG} --quiet -V --target-env ${WIDESTEREO_SPIRV_TARGET}
                    ${ARGN} -I${shader_folder} --depfile ${module}.d
                    -o ${module} ${shader_folder}/${source})
  if(WIDESTEREO_SPIRV_OPT)
    list(APPEND steps COMMAND ${WIDESTEREO_SPIRV_OPT} --target-env=${WIDESTEREO_SPIRV_TARGET} -O
                              ${module} -o ${module})
  endif()
  if(WIDESTEREO_SPIRV_VAL)
    list(APPEND steps COMMAND ${WIDESTEREO_SPIRV_VAL} --target-env ${WIDESTEREO_SPIRV_TARGET}
                              ${module})
  endif()
  add_custom_command(OUTPUT ${module} ${steps} DEPENDS ${shader_folder}/${source} DEPFILE ${module}.d
                     COMMENT "Compiling the kernel ${name}" VERBATIM)
  set(spirv_modules ${spirv_modules} ${module} PARENT_SCOPE)
endfunction()

# With texture units, and as NAME_loads without (shaders/bindings.glsl).
macro(widestereo_shader name source)
  widestereo_module(${name} ${source} ${ARGN})
  widestereo_module(${name}_loads ${source} ${ARGN} -DTEXEL_LOADS)
endmacro()

set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${shader_folder}/kernel_list.h)
file(STRINGS ${shader_folder}/kernel_list.h kernels REGEX "^KERNEL")
foreach(kernel IN LISTS kernels)
  string(REGEX MATCH "^KERNEL\\(([a-z0-9_]+), ([A-Z]+)\\)" matched "${kernel}")
  set(name ${CMAKE_MATCH_1})
  set(of_kernel kernel.comp -DKERNEL=${name}_pixel -DVIEW=${CMAKE_MATCH_2})
  widestereo_shader(${name} ${of_kernel})
  if(name STREQUAL "interpolate")
    widestereo_module(interpolate_half ${of_kernel} -DHALF_PRECISION)
  elseif(name STREQUAL "iterate")
    widestereo_module(iterate_tiled ${of_kernel} -DHAS_PATCH_TILE)
  endif()
endforeach()
# Of Vulkan alone: where an application's image is read or map is written.
foreach(conversion IN ITEMS export_map import_image import_texture)
  widestereo_shader(${conversion} ${conversion}.comp)
endforeach()

add_custom_command(
  OUTPUT ${spirv_folder}/shaders.cpp
  COMMAND ${CMAKE_COMMAND} -DOUTPUT=${spirv_folder}/shaders.cpp "-DMODULES=${spirv_modules}"
          -P ${PROJECT_SOURCE_DIR}/cmake/embed_spirv.cmake
  DEPENDS ${spirv_modules} ${PROJECT_SOURCE_DIR}/cmake/embed_spirv.cmake
  COMMENT "Embedding SPIR-V" VERBATIM)
target_sources(widestereo_vulkan PRIVATE ${spirv_folder}/shaders.cpp)
target_include_directories(widestereo_vulkan SYSTEM PUBLIC ${WIDESTEREO_VULKAN_HEADERS})
