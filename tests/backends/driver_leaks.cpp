// SPDX-License-Identifier: MIT
// Lets LeakSanitizer tell what drivers and layers keep to themselves from leaks of ours. Objects
// that we forget to destroy are found by the validation layer instead
// (VulkanMatch.LeavesNoObjectBehind).
#include <dlfcn.h>

namespace {

// A library that has been unloaded by the end can be named by no suppression.
void* keep_loaded(const char* library) { return dlopen(library, RTLD_NOW | RTLD_NODELETE); }
[[maybe_unused]] void* const driver = keep_loaded("libvulkan_lvp.so");
[[maybe_unused]] void* const layer = keep_loaded("libVkLayer_khronos_validation.so");

}  // namespace

extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libvulkan_lvp.so\nleak:libVkLayer_khronos_validation.so\n";
}
