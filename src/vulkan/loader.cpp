// SPDX-License-Identifier: MIT
#include "vulkan/loader.h"

#include <dlfcn.h>

#include <string>

#include "widestereo/error.h"

namespace widestereo {
namespace {

#ifdef __APPLE__
// Homebrew's folder on Apple silicon is none of those that dlopen() looks into.
constexpr const char* library_names[] = {"libvulkan.1.dylib", "/opt/homebrew/lib/libvulkan.1.dylib",
                                         "libMoltenVK.dylib"};
#else
constexpr const char* library_names[] = {"libvulkan.so.1", "libvulkan.so"};
#endif

}  // namespace

VulkanLoader::VulkanLoader() {
  std::string why;
  for (const char* name : library_names) {
    library_ = dlopen(name, RTLD_NOW | RTLD_LOCAL);
    if (library_ != nullptr) break;
    if (why.empty()) why = dlerror();
  }
  if (library_ != nullptr) {
    get_ = reinterpret_cast<PFN_vkGetInstanceProcAddr>(dlsym(library_, "vkGetInstanceProcAddr"));
    if (get_ == nullptr) why = "it has no vkGetInstanceProcAddr";
  }
  if (get_ == nullptr) {
    if (library_ != nullptr) dlclose(library_);
    throw Error("The Vulkan loader cannot be opened (" + why +
                "); install it (libvulkan1) and a driver.");
  }
}

VulkanLoader::~VulkanLoader() { dlclose(library_); }

}  // namespace widestereo
