// SPDX-License-Identifier: MIT
// What is Vulkan's own: choosing and opening devices, splitting, caches, validation and failures.
// That it computes the right thing is the business of parity_test.cpp.
#include <gmock/gmock.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <future>
#include <set>

#include "bytes_of.h"
#include "device_fixture.h"
#include "match_fixture.h"
#include "same_bits.h"
#include "vulkan/physical_device.h"
#include "vulkan/result.h"
#include "vulkan/submission.h"
#include "vulkan/vulkan_backend.h"
#include "vulkan_fixture.h"
#include "widestereo/matcher.h"
#include "widestereo/synthesis.h"

namespace widestereo::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

DeviceRequest validated(long max_samples_per_dispatch = 0) {
  DeviceRequest request;
  request.validation = true;
  request.max_samples_per_dispatch = max_samples_per_dispatch;
  return request;
}

VkQueueFamilyProperties queue_family(VkQueueFlags can, std::uint32_t bits_of_clock = 64) {
  VkQueueFamilyProperties family{};
  family.queueFlags = can;
  family.queueCount = 1;
  family.timestampValidBits = bits_of_clock;
  return family;
}

TEST(VulkanDevices, AreDescribedCompletely) {
  REQUIRE_VULKAN_OR_SKIP();
  const std::vector<DeviceInfo> devices = list_vulkan_devices(nullptr);
  for (std::size_t i = 0; i < devices.size(); ++i) {
    const DeviceInfo& info = devices[i];
    EXPECT_EQ(info.kind, DeviceKind::vulkan);
    EXPECT_EQ(info.id, "vulkan:" + std::to_string(i));
    EXPECT_FALSE(info.name.empty());
    EXPECT_FALSE(info.type.empty());
    EXPECT_FALSE(info.driver.empty());
    EXPECT_EQ(info.uuid.size(), 32u);
    EXPECT_EQ(info.uuid.find_first_not_of("0123456789abcdef"), std::string::npos);
  }
}

TEST(VulkanDevices, NoDriverIsOneSentence) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto list_without_driver = [] {
    // Loaders of different ages listen to different names.
    for (const char* name : {"VK_ICD_FILENAMES", "VK_DRIVER_FILES"}) {
      setenv(name, "/nonexistent/driver.json", 1);
    }
    std::string why;
    const bool none = list_vulkan_devices(&why).empty();
    const std::string error = error_of([] { open_vulkan_device(0, {}); });
    std::cerr << why << error;
    std::_Exit(none && !why.empty() && !error.empty() ? 0 : 1);
  };
  EXPECT_EXIT(list_without_driver(), ::testing::ExitedWithCode(0), "driver|loader");
}

TEST(VulkanDevices, MissingIndexIsAnError) {
  REQUIRE_VULKAN_OR_SKIP();
  EXPECT_THAT(error_of([] { open_vulkan_device(1000, {}); }), HasSubstr("no Vulkan device 1000"));
  EXPECT_THAT(error_of([] { open_vulkan_device(-1, {}); }), HasSubstr("no Vulkan device -1"));
}

/// `type`: what the device says it is, on which the kind of its kernels depends.
void run_every_kernel_on(VkPhysicalDeviceType type) {
  const FaultyLoader::Scope scope;
  FaultyLoader::faults().type = type;
  const auto device = open_vulkan_device(0, validated(), FaultyLoader::get_instance_proc_addr());
  std::set<std::string> have_run;
  for (const char* preset : {"paper", "fast"}) {
    SCOPED_TRACE(preset);
    KernelFixture match = small_match(preset);
    const Schedule& cold = match.schedule();
    const auto backend = make_backend(*device, cold);
    upload(*backend, match);
    Schedule warm = make_warm_schedule(match.rig(), options_of_small_match(preset));
    set_motion(warm, match.rig(), Eigen::Isometry3d::Identity(), 1);
    for (const Schedule& schedule : {cold, warm}) {
      backend->run(schedule, {});
      for (const KernelTime& time : backend->times()) have_run.insert(time.kernel);
    }
    EXPECT_LT(cv::Mat_<cv::Vec4f>(backend->hypotheses(1))(19, 19)[3], INVALID_COST);
  }
  for (int i = 0; i < kernel_count; ++i) {
    const auto kernel = static_cast<Kernel>(i);
    EXPECT_EQ(have_run.contains(to_string(kernel)), kernel != Kernel::iterate_raster)
        << to_string(kernel);
  }
  EXPECT_THAT(device->validation_messages(), IsEmpty());
}

constexpr VkPhysicalDeviceType type_of_gpu = VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU;
constexpr VkPhysicalDeviceType type_of_software = VK_PHYSICAL_DEVICE_TYPE_CPU;

TEST(VulkanMatch, RunsEveryKernelWithoutValidationMessage) {
  REQUIRE_VULKAN_OR_SKIP();
  for (const VkPhysicalDeviceType type : {type_of_gpu, type_of_software}) {
    SCOPED_TRACE(type);
    run_every_kernel_on(type);
  }
}

TEST(VulkanMatch, CompilesOnceAndOnlyWhatItRuns) {
  REQUIRE_VULKAN_OR_SKIP();
  const FaultyLoader::Scope scope;
  const auto device = open_vulkan_device(0, validated(), FaultyLoader::get_instance_proc_addr());
  KernelFixture match = small_match("fast");
  const Schedule& cold = match.schedule();
  Schedule warm = make_warm_schedule(match.rig(), options_of_small_match("fast"));
  set_motion(warm, match.rig(), Eigen::Isometry3d::Identity(), 1);
  const auto backend = make_backend(*device, cold);
  upload(*backend, match);
  const int& compiled = FaultyLoader::faults().calls["vkCreateComputePipelines"];
  EXPECT_EQ(compiled, 0);
  std::set<Kernel> kernels;
  for (const Schedule& schedule : {cold, cold, warm, cold, warm}) {
    backend->run(schedule, {});
    for (const Dispatch& dispatch : schedule.dispatches) kernels.insert(dispatch.kernel);
    EXPECT_EQ(compiled, static_cast<int>(kernels.size()));
  }
  EXPECT_LT(compiled, kernel_count - 1);
}

/// Whatever fails in one of the threads that compile is told as it is, and may be tried again.
TEST(VulkanMatch, ReportsWhatFailsToCompile) {
  REQUIRE_VULKAN_OR_SKIP();
  const FaultyLoader::Scope scope;
  const auto device = open_vulkan_device(0, validated(), FaultyLoader::get_instance_proc_addr());
  KernelFixture match = small_match("paper");
  const Schedule& schedule = match.schedule();
  const auto backend = make_backend(*device, schedule);
  upload(*backend, match);
  FaultyLoader::faults().failing_function = "vkCreateComputePipelines";
  FaultyLoader::faults().failing_call = 2;
  EXPECT_THAT(error_of([&] { backend->compile(schedule); }), HasSubstr("compile the kernel"));
  backend->run(schedule, {});
  EXPECT_LT(cv::Mat_<cv::Vec4f>(backend->hypotheses(1))(19, 19)[3], INVALID_COST);
  EXPECT_THAT(device->validation_messages(), IsEmpty());
}

TEST(VulkanMatch, TellsItsProgressAndTimesWhenSplit) {
  REQUIRE_VULKAN_OR_SKIP();
  const auto device = open_vulkan_device(0, validated(20000));
  KernelFixture match = small_match();
  const auto backend = make_backend(*device, match.schedule());
  upload(*backend, match);
  std::vector<double> shares;
  backend->run(match.schedule(), [&](double share) { shares.push_back(share); });

  EXPECT_GT(shares.size(), 3u);
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  EXPECT_DOUBLE_EQ(shares.back(), 1);
  int dispatches = 0;
  for (const KernelTime& time : backend->times()) dispatches += time.dispatches;
  EXPECT_EQ(dispatches, static_cast<int>(match.schedule().dispatches.size()));
  EXPECT_EQ(backend->times().front().kernel, "interpolate");
  EXPECT_GT(backend->device_bytes(), 45u * 45 * 2 * 52);

  // Planes of pixels that see the scene have a cost, and the checks ran.
  const cv::Mat_<cv::Vec4f> planes = backend->hypotheses(1).clone();
  const cv::Mat_<cv::Vec4f> checks = backend->checks(1);
  EXPECT_LT(planes(19, 19)[3], 1.0f);
  EXPECT_GT(cv::norm(cv::Vec3f(planes(19, 19).val)), 0.1);
  EXPECT_NE(checks(19, 19), cv::Vec4f());
  EXPECT_THAT(device->validation_messages(), IsEmpty());
}

TEST(VulkanMatch, KernelsNeedNotBeTimed) {
  REQUIRE_VULKAN_OR_SKIP();
  KernelFixture match = small_match();
  const auto device = open_vulkan_device(0, validated());
  const auto backend = make_backend(*device, match.schedule());
  const cv::Mat timed = run(*backend, match);
  const std::vector<KernelTime> times = backend->times();
  double sum = 0;
  for (const KernelTime& time : times) sum += time.milliseconds;
  EXPECT_GT(sum, 0);
  EXPECT_NEAR(backend->device_milliseconds(), sum, 1e-9 * sum);
  backend->time_kernels(false);
  EXPECT_TRUE(same_bits(timed, run(*backend, match)));
  EXPECT_GT(backend->device_milliseconds(), 0);
  ASSERT_EQ(backend->times().size(), times.size());
  for (const KernelTime& time : backend->times()) EXPECT_EQ(time.milliseconds, 0) << time.kernel;
  EXPECT_THAT(device->validation_messages(), IsEmpty());
}

TEST(VulkanMatch, BitsDependNeitherOnSplittingNorOnTheRun) {
  REQUIRE_VULKAN_OR_SKIP();
  KernelFixture match = small_match();
  const cv::Mat expected = run(*open_vulkan_device(0, {}), match);
  EXPECT_TRUE(same_bits(expected, run(*open_vulkan_device(0, {}), match)));
  for (const long samples : {1L, 3000L, 1000000000000L}) {
    DeviceRequest request;
    request.max_samples_per_dispatch = samples;
    EXPECT_TRUE(same_bits(expected, run(*open_vulkan_device(0, request), match))) << samples;
  }
}

TEST(VulkanMatch, AMatcherCanRunAgain) {
  REQUIRE_VULKAN_OR_SKIP();
  KernelFixture match = small_match();
  const auto device = open_vulkan_device(0, validated());
  const auto backend = make_backend(*device, match.schedule());
  const cv::Mat first = run(*backend, match);
  EXPECT_TRUE(same_bits(first, run(*backend, match)));
  EXPECT_THAT(device->validation_messages(), IsEmpty());
}

TEST(VulkanMatch, ARunAbortedAtAnyCallbackLeavesTheMatcherUsable) {
  REQUIRE_VULKAN_OR_SKIP();
  KernelFixture match = small_match();
  const FaultyLoader::Scope scope;
  const auto device =
      open_vulkan_device(0, validated(5000), FaultyLoader::get_instance_proc_addr());
  const auto backend = make_backend(*device, match.schedule());
  const cv::Mat expected = run(*backend, match);
  for (const int last : {1, 2, 3}) {
    int callbacks = 0;
    EXPECT_THROW(backend->run(match.schedule(),
                              [&](double) {
                                if (++callbacks == last) throw Error("Stop.");
                              }),
                 Error);
    EXPECT_EQ(callbacks, last);
    EXPECT_EQ(FaultyLoader::faults().waits, FaultyLoader::faults().submissions)
        << "left in flight, where uploads do not wait for it";
    EXPECT_TRUE(same_bits(expected, run(*backend, match))) << last;
    EXPECT_THAT(device->validation_messages(), IsEmpty()) << last;
  }
}

TEST(VulkanMatch, TexturesAndStorageImagesGiveTheSameBits) {
  REQUIRE_VULKAN_OR_SKIP();
  Application application;
  KernelFixture match = small_match();
  match.schedule().constants.filter = static_cast<int>(Filter::exact);
  std::vector<cv::Mat> results;
  for (const bool sampled : {false, true}) {
    VulkanBackend backend(application.context, sizes_of(match.schedule().views),
                          match.schedule().constants, application.cache, {.sampled = sampled});
    results.push_back(run(backend, match));
  }
  EXPECT_TRUE(same_bits(results[0], results[1]));
  EXPECT_THAT(application.instance.validation_messages(), IsEmpty());
}

TEST(VulkanMatch, TextureUnitsFilterAsWellAsTheirPositions) {
  REQUIRE_VULKAN_OR_SKIP();
  Application application;
  KernelFixture match = small_match();
  keep_first(match.schedule(), Kernel::initialise);  // no choice amplifies rounding
  match.schedule().constants.texels_per_pixel = 2;   // positions are rounded to 1/512 pixel
  const auto costs = [&](const VulkanContext& context, Filter filter) {
    match.schedule().constants.filter = static_cast<int>(filter);
    VulkanBackend backend(context, sizes_of(match.schedule().views), match.schedule().constants,
                          application.cache, {.sampled = true});
    return std::pair(run(backend, match), static_cast<double>(backend.device_bytes()));
  };
  VulkanHandles without_feature = application.context.handles();
  without_feature.extended_storage_formats = false;
  const VulkanContext in_floats(without_feature);
  const auto [exact, of_exact] = costs(application.context, Filter::exact);
  const auto [floats, of_floats] = costs(in_floats, Filter::device);
  const auto [halves, of_halves] = costs(application.context, Filter::device);
  ASSERT_TRUE(application.context.filters_half_precision()) << "which Vulkan's profiles ask for";
  const auto expect_close = [](const cv::Mat& a, const cv::Mat& b) {
    cv::Mat difference;
    cv::absdiff(a, b, difference);
    double largest = 0;
    cv::minMaxLoc(difference, nullptr, &largest);
    EXPECT_GT(largest, 0) << "both were filtered alike";
    // Planes have the same bits; costs differ as positions do, and by all where visibility flips.
    EXPECT_LT(cv::countNonZero(difference > 0.02), 4);
  };
  expect_close(exact, floats);
  expect_close(exact, halves);
  expect_close(floats, halves);
  EXPECT_EQ(of_exact, of_floats);
  EXPECT_LT(of_halves, of_floats);
  EXPECT_THAT(application.instance.validation_messages(), IsEmpty());
}

TEST(VulkanMatch, RecordsIntoAnApplicationsCommandBuffer) {
  REQUIRE_VULKAN_OR_SKIP();
  Application application;
  const VulkanContext adopted(application.context.handles());
  PipelineCache cache(adopted, {});
  KernelFixture match = small_match();
  VulkanBackend backend(adopted, sizes_of(match.schedule().views), match.schedule().constants,
                        cache);
  const cv::Mat expected = run(backend, match);
  const cv::Mat nothing(match.view(0).rays.size(), CV_32FC4, cv::Scalar::all(0));
  backend.set_hypotheses(0, nothing);

  const auto pool = make_command_pool(application.context);
  Submission submission(application.context, pool.get(), 2);
  const VkCommandBuffer commands = submission.begin();
  backend.record_parameters(commands, match.schedule());
  backend.record_dispatches({&commands, 1}, match.schedule());
  EXPECT_EQ(cv::norm(backend.hypotheses(0)), 0) << "recording must not run anything";
  submission.submit();
  submission.wait();
  EXPECT_TRUE(same_bits(expected, download(backend, match.rig())));
  EXPECT_THAT(application.instance.validation_messages(), IsEmpty());
}

TEST(VulkanContexts, RefuseHandlesThatDoNotDo) {
  REQUIRE_VULKAN_OR_SKIP();
  const Application application;
  const VulkanHandles good = application.context.handles();
  const auto error = [](const VulkanHandles& handles) {
    return error_of([&] { const VulkanContext adopted(handles); });
  };
  EXPECT_EQ(error(good), "");
  const auto without = [&](auto VulkanHandles::*handle) {
    VulkanHandles handles = good;
    handles.*handle = nullptr;
    return error(handles);
  };
  EXPECT_THAT(without(&VulkanHandles::get_instance_proc_addr), HasSubstr("get_instance_proc_addr"));
  EXPECT_THAT(without(&VulkanHandles::instance), HasSubstr("no instance"));
  EXPECT_THAT(without(&VulkanHandles::physical_device), HasSubstr("no physical_device"));
  EXPECT_THAT(without(&VulkanHandles::device), HasSubstr("no device"));
  EXPECT_THAT(without(&VulkanHandles::queue), HasSubstr("no queue"));
  VulkanHandles handles = good;
  handles.queue_family = 1000;
  EXPECT_THAT(error(handles), HasSubstr("no queue family 1000"));

  const FaultyLoader::Scope scope;
  FaultyLoader::faults().queue_families = {queue_family(VK_QUEUE_COMPUTE_BIT),
                                           queue_family(VK_QUEUE_TRANSFER_BIT)};
  handles.get_instance_proc_addr = FaultyLoader::get_instance_proc_addr();
  handles.queue_family = 0;
  EXPECT_EQ(error(handles), "");
  handles.queue_family = 1;
  EXPECT_THAT(error(handles), HasSubstr("cannot compute"));
}

/// As of an application that gives no VkApplicationInfo.
class InstanceOfVulkan10 {
 public:
  explicit InstanceOfVulkan10(PFN_vkGetInstanceProcAddr get) {
    const auto create =
        reinterpret_cast<PFN_vkCreateInstance>(get(VK_NULL_HANDLE, "vkCreateInstance"));
    VkInstanceCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
    check(create(&info, nullptr, &instance_), "The Vulkan loader", "make an instance");
    destroy_ = reinterpret_cast<PFN_vkDestroyInstance>(get(instance_, "vkDestroyInstance"));
    const auto enumerate = reinterpret_cast<PFN_vkEnumeratePhysicalDevices>(
        get(instance_, "vkEnumeratePhysicalDevices"));
    std::uint32_t count = 1;
    enumerate(instance_, &count, &first_device_);
  }
  ~InstanceOfVulkan10() { destroy_(instance_, nullptr); }
  InstanceOfVulkan10(const InstanceOfVulkan10&) = delete;
  InstanceOfVulkan10& operator=(const InstanceOfVulkan10&) = delete;

  VkInstance handle() const { return instance_; }
  VkPhysicalDevice first_device() const { return first_device_; }

 private:
  VkInstance instance_ = VK_NULL_HANDLE;
  VkPhysicalDevice first_device_ = VK_NULL_HANDLE;
  PFN_vkDestroyInstance destroy_ = nullptr;
};

TEST(VulkanContexts, RefuseInstancesOfVulkan10) {
  REQUIRE_VULKAN_OR_SKIP();
  const Application application;
  const InstanceOfVulkan10 old(application.loader.get_instance_proc_addr());
  VulkanHandles handles = application.context.handles();
  const auto error = [&handles] { return error_of([&] { const VulkanContext adopted(handles); }); };
  handles.instance = old.handle();
  handles.physical_device = old.first_device();
  EXPECT_THAT(error(), HasSubstr("set VkApplicationInfo::apiVersion"));

  // As without a loader.
  handles = application.context.handles();
  handles.get_instance_proc_addr = FaultyLoader::get_instance_proc_addr();
  const FaultyLoader::Scope scope;
  FaultyLoader::faults().missing_function = "vkGetPhysicalDeviceProperties2";
  EXPECT_THAT(error(), HasSubstr("set VkApplicationInfo::apiVersion"));
}

TEST(VulkanQueues, AreThoseThatTellTimeThenThoseThatDoNotDraw) {
  REQUIRE_VULKAN_OR_SKIP();
  const Application application;
  const FaultyLoader::Scope scope;
  const auto chosen_of = [&](std::vector<VkQueueFamilyProperties> families) {
    FaultyLoader::faults() = {.queue_families = std::move(families)};
    const auto functions = InstanceFunctions::load(FaultyLoader::get_instance_proc_addr(),
                                                   application.instance.handle());
    return compute_queue_family(functions, application.instance.physical_devices().at(0));
  };
  const auto drawing = queue_family(VK_QUEUE_COMPUTE_BIT | VK_QUEUE_GRAPHICS_BIT);
  const auto computing = queue_family(VK_QUEUE_COMPUTE_BIT);
  const auto computing_without_clock = queue_family(VK_QUEUE_COMPUTE_BIT, 0);
  const auto copying = queue_family(VK_QUEUE_TRANSFER_BIT);
  EXPECT_EQ(chosen_of({drawing, computing}), 1u);
  EXPECT_EQ(chosen_of({drawing, copying, computing, computing}), 2u);
  EXPECT_EQ(chosen_of({drawing, computing_without_clock}), 0u);
  EXPECT_EQ(chosen_of({computing_without_clock, drawing}), 1u);
  EXPECT_EQ(chosen_of({drawing, drawing}), 0u);
  EXPECT_EQ(chosen_of({drawing, copying}), 0u);
  EXPECT_EQ(chosen_of({copying}), std::nullopt);
}

TEST(VulkanMatch, LeavesNoObjectBehind) {
  REQUIRE_VULKAN_OR_SKIP();
  const VulkanLoader loader;
  const VulkanInstance instance(loader.get_instance_proc_addr(), true);
  {
    const VulkanContext context(loader.get_instance_proc_addr(), instance.handle(),
                                instance.physical_devices().at(0));
    PipelineCache cache(context, {});
    KernelFixture match = small_match();
    VulkanBackend backend(context, sizes_of(match.schedule().views), match.schedule().constants,
                          cache);
    run(backend, match);
  }
  // The layer names every object that outlives its device.
  EXPECT_THAT(instance.validation_messages(), IsEmpty());
}

TEST(VulkanMatch, RefusesWhatDoesNotFit) {
  REQUIRE_VULKAN_OR_SKIP();
  KernelFixture match = small_match();
  const auto device = open_vulkan_device(0, validated());
  const auto backend = make_backend(*device, match.schedule());
  EXPECT_THAT(error_of([&] { backend->set_rays(1, match.view(0).rays); }), HasSubstr("38x38"));
  EXPECT_THAT(error_of([&] { backend->set_intensity(0, match.view(0).rays); }),
              HasSubstr("CV_32FC1"));
  Schedule other = match.schedule();
  other.constants.window_radius = 3;
  EXPECT_THAT(error_of([&] { backend->run(other, {}); }), HasSubstr("constants"));
  Schedule raster = match.schedule();
  raster.dispatches.back().kernel = Kernel::iterate_raster;
  EXPECT_THAT(error_of([&] { backend->run(raster, {}); }), HasSubstr("sequential"));
  // Refused while commands were recorded, which the next run drops.
  backend->run(match.schedule(), {});
  EXPECT_THAT(device->validation_messages(), IsEmpty());
}

constexpr int demo_size = 32;

/// The demo scene by the preset `fast` on the first device, which states `faults`.
StereoResult match_demo_with(const Faults& faults, Filter filter) {
  const RenderedPair pair = render_demo(demo_size);
  Options options = Options::preset_named("fast");
  std::tie(options.min_distance, options.max_distance) = demo_distance_range();
  options.sweep_steps = 4;
  options.filter = filter;
  const FaultyLoader::Scope scope;
  FaultyLoader::faults() = faults;
  Device device(open_vulkan_device(0, validated(), FaultyLoader::get_instance_proc_addr()));
  const StereoResult result =
      Matcher(device, pair.rig, options).match(pair.views[0].image, pair.views[1].image);
  EXPECT_THAT(device.validation_messages(), IsEmpty());
  return result;
}

TEST(VulkanMatch, NeedsNoClock) {
  REQUIRE_VULKAN_OR_SKIP();
  const StereoResult expected = match_demo_with({}, Filter::exact);
  const auto without_clock =
      queue_family(VK_QUEUE_COMPUTE_BIT | VK_QUEUE_GRAPHICS_BIT | VK_QUEUE_TRANSFER_BIT, 0);
  const StereoResult result = match_demo_with({.queue_families = {without_clock}}, Filter::exact);
  for (std::size_t view = 0; view < 2; ++view) {
    expect_same_bits(expected.views[view], result.views[view]);
  }
  EXPECT_GT(expected.device_milliseconds, 0);
  EXPECT_EQ(result.device_milliseconds, 0);
  ASSERT_EQ(result.times.size(), expected.times.size());
  for (std::size_t i = 0; i < result.times.size(); ++i) {
    EXPECT_EQ(result.times[i].milliseconds, 0);
    EXPECT_EQ(result.times[i].dispatches, expected.times[i].dispatches);
  }
}

TEST(VulkanMatch, SoftwareLoadsTheBitsThatGpusGather) {
  REQUIRE_VULKAN_OR_SKIP();
  const DeviceInfo device = list_vulkan_devices(nullptr).at(0);
  const StereoResult gpu = match_demo_with({.type = type_of_gpu}, Filter::exact);
  const StereoResult software = match_demo_with({.type = type_of_software}, Filter::exact);
  // As SwiftShader's, which are Vulkan's least.
  const StereoResult of_few_images =
      match_demo_with({.type = type_of_software, .storage_images = 4}, Filter::exact);
  EXPECT_EQ(of_few_images.device_bytes, gpu.device_bytes) << "it samples, too";
  EXPECT_NE(of_few_images.device_bytes, software.device_bytes);
  ASSERT_EQ(gpu.views.size(), software.views.size());
  for (std::size_t view = 0; view < gpu.views.size(); ++view) {
    SCOPED_TRACE(view);
    expect_same_bits(gpu.views[view], of_few_images.views[view]);
    const ViewResult& gathered = gpu.views[view];
    const ViewResult& loaded = software.views[view];
    EXPECT_NEAR(cv::mean(gathered.cost)[0], cv::mean(loaded.cost)[0], 0.01);
    // A compiler that contracts may do so differently in each.
    if (!why_bits_may_differ(device).empty()) continue;
    EXPECT_TRUE(same_bits(gathered.distance, loaded.distance));
    EXPECT_TRUE(same_bits(gathered.normals, loaded.normals));
    EXPECT_TRUE(same_bits(gathered.cost, loaded.cost));
    EXPECT_TRUE(same_bits(gathered.confidence, loaded.confidence));
  }
  // Three neighbours more of each texel, of two views at three levels.
  double bytes = 0;
  for (const int size : {demo_size, demo_size / 2, demo_size / 4}) {
    bytes += 2 * 12 * std::pow(2 * (size + 2 * APRON), 2);
  }
  const double more =
      static_cast<double>(software.device_bytes) - static_cast<double>(gpu.device_bytes);
  // GPUs round both to whole tiles of up to 64 KiB, here by 0.72 of the difference at most.
  EXPECT_NEAR(more, bytes, (device.type == "cpu" ? 0.01 : 0.75) * bytes);
}

TEST(VulkanMatch, FiltersExactlyWhereTheDeviceCannotAndSaysSo) {
  REQUIRE_VULKAN_OR_SKIP();
  // What texture units do is not counted.
  const auto operations = [](const StereoResult& result) {
    double sum = 0;
    for (const KernelTime& time : result.times) sum += time.work.operations;
    return sum;
  };
  const StereoResult by_device = match_demo_with({.type = type_of_gpu}, Filter::device);
  const StereoResult without =
      match_demo_with({.no_filtering = true, .type = type_of_gpu}, Filter::device);
  EXPECT_EQ(by_device.filter, Filter::device);
  EXPECT_EQ(without.filter, Filter::exact);
  EXPECT_GT(operations(without), operations(by_device));
}

TEST(VulkanMatch, WorkgroupsShareWhatTheirPatchesHaveInCommonOrNot) {
  REQUIRE_VULKAN_OR_SKIP();
  const FaultyLoader::Scope scope;
  FaultyLoader::faults() = {.type = type_of_gpu};
  const auto device = open_vulkan_device(0, validated(), FaultyLoader::get_instance_proc_addr());
  // A small tile, the largest one without and with weights, none.
  for (const auto& [window_radius, weight_scale] :
       {std::pair(2, 0.0), {5, 0.0}, {5, 0.1}, {6, 0.0}}) {
    SCOPED_TRACE(testing::Message() << window_radius << ' ' << weight_scale);
    KernelFixture match = pair_to_iterate(CameraModel::kannala_brandt, window_radius, weight_scale);
    expect_costs_of_patches(*device, match);
  }
  EXPECT_THAT(device->validation_messages(), IsEmpty());
}

TEST(VulkanValidation, MissingLayerIsAnError) {
  REQUIRE_VULKAN_OR_SKIP();
  const FaultyLoader::Scope scope;
  FaultyLoader::faults().no_layers = true;
  const auto get = FaultyLoader::get_instance_proc_addr();
  EXPECT_THAT(error_of([&] { open_vulkan_device(0, validated(), get); }),
              HasSubstr("vulkan-validationlayers"));
  EXPECT_EQ(error_of([&] { open_vulkan_device(0, {}, get); }), "");
}

/// Matchers of one device share its queue, which Vulkan lets one thread at a time use.
TEST(VulkanValidation, HasNothingToSayOfSubmissionsFromTwoThreads) {
  REQUIRE_VULKAN_OR_SKIP();
  Application application;
  const auto submit_often = [&application] {
    const auto pool = make_command_pool(application.context);
    Submission submission(application.context, pool.get(), 2);
    for (int i = 0; i < 1000; ++i) {
      submission.begin();
      submission.submit();
    }
  };
  auto other = std::async(std::launch::async, submit_often);
  submit_often();
  other.get();
  EXPECT_THAT(application.instance.validation_messages(), IsEmpty());
}

TEST(VulkanValidation, ReportsAMissingBarrier) {
  REQUIRE_VULKAN_OR_SKIP();
  // The net must catch something: two clears of one image without a barrier between.
  Application application;
  const VulkanContext& context = application.context;
  const DeviceFunctions& vk = context.vk();
  const Buffer buffer = make_device_buffer(context, 64, VK_BUFFER_USAGE_TRANSFER_DST_BIT, "a test");
  const auto pool = make_command_pool(context);
  Submission submission(context, pool.get(), 2);
  const VkCommandBuffer commands = submission.begin();
  const float zeros[16] = {};
  vk.vkCmdUpdateBuffer(commands, buffer.handle.get(), 0, sizeof zeros, zeros);
  vk.vkCmdUpdateBuffer(commands, buffer.handle.get(), 0, sizeof zeros, zeros);
  submission.submit();
  submission.wait();
  EXPECT_THAT(application.instance.validation_messages(),
              ::testing::Contains(HasSubstr("SYNC-HAZARD-WRITE-AFTER-WRITE")));
}

class VulkanFailures : public ::testing::Test {
 protected:
  void SetUp() override { REQUIRE_VULKAN_OR_SKIP(); }

  /// The message of a whole match through the faulty loader, which must not crash whatever fails.
  std::string message_of_match() {
    return error_of([this] {
      const auto device = open_vulkan_device(0, request_, FaultyLoader::get_instance_proc_addr());
      run(*device, match_);
    });
  }

  KernelFixture match_ = small_match();
  DeviceRequest request_;
  FaultyLoader::Scope scope_;
};

TEST_F(VulkanFailures, EveryAllocationMayFail) {
  EXPECT_EQ(message_of_match(), "");
  const int allocations = FaultyLoader::faults().allocations;
  EXPECT_GE(allocations, 8);
  for (int i = 0; i < allocations; ++i) {
    FaultyLoader::faults() = {.failing_allocation = i};
    EXPECT_THAT(message_of_match(), HasSubstr("out of device memory")) << i;
  }
}

TEST_F(VulkanFailures, TheDeviceMayBeLostAtAnySubmission) {
  request_.max_samples_per_dispatch = 40000;
  EXPECT_EQ(message_of_match(), "");
  const int submissions = FaultyLoader::faults().submissions;
  const int waits = FaultyLoader::faults().waits;
  EXPECT_GE(submissions, 10);
  EXPECT_EQ(waits, submissions);
  // Clearing, an upload, in the middle of the run, the last download.
  for (const int i : {0, 2, submissions / 2, submissions - 1}) {
    FaultyLoader::faults() = {.failing_submission = i};
    EXPECT_THAT(message_of_match(), HasSubstr("the device was lost")) << i;
    FaultyLoader::faults() = {.failing_wait = i};
    EXPECT_THAT(message_of_match(), HasSubstr("the device was lost")) << i;
  }
}

TEST_F(VulkanFailures, MissingFeaturesAreNamed) {
  FaultyLoader::faults() = {.no_formats = true, .type = type_of_software};
  EXPECT_THAT(message_of_match(), HasSubstr("lacks storage images of four"));
  FaultyLoader::faults() = {.no_formats = true, .type = type_of_gpu};
  EXPECT_THAT(message_of_match(), HasSubstr("lacks sampled and storage images"));
  FaultyLoader::faults() = {.queue_families = {queue_family(VK_QUEUE_TRANSFER_BIT)}};
  EXPECT_THAT(message_of_match(), HasSubstr("no compute queue"));
  FaultyLoader::faults() = {.old_device = true};
  EXPECT_THAT(message_of_match(), HasSubstr("offers Vulkan 1.0.0"));
  FaultyLoader::faults() = {.largest_image = 40};
  EXPECT_THAT(message_of_match(), HasSubstr("largest image width is 40"));
  FaultyLoader::faults() = {.largest_resource = 1000};
  EXPECT_THAT(message_of_match(), HasSubstr("its maxResourceSize is 1 MiB"));
  FaultyLoader::faults() = {.type = type_of_software, .largest_buffer = 50000};
  EXPECT_THAT(message_of_match(),
              HasSubstr("the images of 1 MiB: its maxTexelBufferElements times 4 bytes"));
  FaultyLoader::faults() = {.type = type_of_gpu, .largest_buffer = 50000};
  EXPECT_THAT(message_of_match(),
              HasSubstr("the viewing rays of 1 MiB: its maxStorageBufferRange"));
  FaultyLoader::faults() = {.largest_allocation = 50000};
  EXPECT_THAT(message_of_match(), HasSubstr("its maxMemoryAllocationSize is 1 MiB"));
  FaultyLoader::faults() = {.type = type_of_gpu, .storage_buffers = 4};
  EXPECT_THAT(message_of_match(), HasSubstr("maxPerStageDescriptorStorageBuffers is 4, but 8"));
  FaultyLoader::faults() = {.largest_push_constants = 16};
  EXPECT_THAT(message_of_match(), HasSubstr("maxPushConstantsSize is 16, but 68"));
}

TEST_F(VulkanFailures, MissingFunctionsAreNamed) {
  for (const char* name : {"vkEnumerateInstanceVersion", "vkGetPhysicalDeviceProperties2",
                           "vkCreateDevice", "vkCmdDispatch"}) {
    FaultyLoader::faults() = {.missing_function = name};
    EXPECT_THAT(message_of_match(), HasSubstr(name));
  }
}

class VulkanCache : public ::testing::Test {
 protected:
  void SetUp() override {
    REQUIRE_VULKAN_OR_SKIP();
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ("widestereo-cache-" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
    path_ = folder_ / "pipelines.bin";
  }
  void TearDown() override {
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
  }

  cv::Mat match_with_cache() {
    KernelFixture match = small_match();
    DeviceRequest request;
    request.pipeline_cache = path_.string();
    return run(*open_vulkan_device(0, request), match);
  }
  bool is_used() {
    Application application(false);
    return PipelineCache(application.context, path_).loaded_from_file();
  }
  std::string content() const { return bytes_of(path_); }
  void overwrite(const std::string& content) const {
    std::ofstream(path_, std::ios::binary) << content;
  }

  std::filesystem::path folder_;
  std::filesystem::path path_;
};

TEST_F(VulkanCache, IsWrittenAndUsed) {
  EXPECT_FALSE(is_used());
  const cv::Mat first = match_with_cache();
  EXPECT_TRUE(is_used());
  const std::string written = content();
  EXPECT_TRUE(same_bits(first, match_with_cache()));
  EXPECT_EQ(content(), written);
}

/// Matchers of one device have its queue and its cache in common.
TEST_F(VulkanCache, AndQueueAreSharedByMatchersInDifferentThreads) {
  const RenderedPair pair = render_demo(demo_size);
  const Options options = options_of_small_match("fast");
  Device device = Device::open({.device = "vulkan:0",
                                .validation = true,
                                .pipeline_cache = path_.string(),
                                .max_samples_per_dispatch = 40000});  // many submissions
  const auto match = [&] { return Matcher(device, pair.rig, options).match(images_of(pair)); };
  auto first = std::async(std::launch::async, match);
  auto second = std::async(std::launch::async, match);
  const std::array results = {first.get(), second.get()};
  const StereoResult alone = match();
  for (const StereoResult& result : results) expect_same_bits(alone, result);
  expect_no_validation_messages(device);
  EXPECT_TRUE(is_used());
}

TEST_F(VulkanCache, DamagedFilesAreIgnoredAndReplaced) {
  const cv::Mat expected = match_with_cache();
  const std::string intact = content();
  std::string flipped = intact;
  flipped.back() = static_cast<char>(flipped.back() ^ 1);
  // 16 bytes: as many as the number in them and the 24 of a whole header add up to by overflow.
  const std::string overflowing = intact.substr(0, 8) + "\xf8" + std::string(7, '\xff');
  const std::vector<std::string> damaged = {"",           intact.substr(0, 9),
                                            overflowing,  intact.substr(0, intact.size() - 1),
                                            intact + "x", flipped};
  // As large as it says, and more than there is memory for: a sparse file.
  constexpr std::uint64_t huge = std::uint64_t{1} << 40;
  std::string header = intact.substr(0, 24);
  std::memcpy(header.data() + 8, &huge, sizeof huge);
  overwrite(header);
  std::filesystem::resize_file(path_, huge + header.size());
  EXPECT_FALSE(is_used());
  EXPECT_TRUE(same_bits(expected, match_with_cache()));
  EXPECT_TRUE(is_used());
  for (const std::string& content_before : damaged) {
    overwrite(content_before);
    EXPECT_FALSE(is_used());
    EXPECT_TRUE(same_bits(expected, match_with_cache()));
    EXPECT_TRUE(is_used());
  }
}

TEST_F(VulkanCache, IsReadAgainWhereItGrowsMeanwhile) {
  const FaultyLoader::Scope scope;
  FaultyLoader::faults().growing_caches = 2;
  const PFN_vkGetInstanceProcAddr get = FaultyLoader::get_instance_proc_addr();
  VulkanInstance instance(get, false);
  VulkanContext context(get, instance.handle(), instance.physical_devices().at(0));
  PipelineCache(context, path_).save();
  EXPECT_EQ(FaultyLoader::faults().growing_caches, 0);
  EXPECT_TRUE(is_used());
}

TEST_F(VulkanCache, OtherFilesAreNeitherReadNorReplaced) {
  for (const std::string& content_before : {std::string("no cache"), std::string(500, '\0')}) {
    overwrite(content_before);
    EXPECT_FALSE(is_used());
    EXPECT_THAT(error_of([this] { match_with_cache(); }), HasSubstr("is no pipeline cache"));
    EXPECT_TRUE(content() == content_before);
  }
  std::filesystem::resize_file(path_, std::uintmax_t{1} << 40);  // sparse
  EXPECT_THAT(error_of([this] { match_with_cache(); }), HasSubstr("is no pipeline cache"));
  path_ = folder_ / "endless";
  std::filesystem::create_symlink("/dev/full", path_);
  EXPECT_THAT(error_of([this] { match_with_cache(); }), HasSubstr("is no pipeline cache"));
}

TEST_F(VulkanCache, UnwritablePathIsAnError) {
  path_ = folder_ / "missing folder" / "pipelines.bin";
  EXPECT_THAT(error_of([this] { match_with_cache(); }), HasSubstr("missing folder"));
}

}  // namespace
}  // namespace widestereo::test
