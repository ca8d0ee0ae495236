# Writes a C++ file with SPIR-V modules as arrays: cmake -DOUTPUT=... -DMODULES=a.spv;b.spv -P embed_spirv.cmake
set(arrays "")
set(cases "")
foreach(module IN LISTS MODULES)
  get_filename_component(name ${module} NAME_WE)
  file(READ ${module} hexadecimal HEX)
  # Words of little-endian files.
  string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1u," words "${hexadecimal}")
  string(APPEND arrays "constexpr std::uint32_t ${name}[] = {${words}};\n")
  string(APPEND cases "  if (name == \"${name}\") return ${name};\n")
endforeach()
file(WRITE ${OUTPUT} "// Generated from shaders/.
#include \"vulkan/shaders.h\"

namespace widestereo {
namespace {

${arrays}
}  // namespace

std::span<const std::uint32_t> shader_code(std::string_view name) {
${cases}  return {};
}

}  // namespace widestereo
")
