// SPDX-License-Identifier: MIT
// The host side of the CUDA back end when things go wrong, on an emulated device.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <opencv2/core.hpp>
#include <thread>

#include "cuda/cuda_device.h"
#include "cuda/cuda_target.h"
#include "emulated_runtime.h"
#include "error_of.h"
#include "kernel/kernel_fixture.h"
#include "matching/backend.h"
#include "same_bits.h"
#include "widestereo/cuda.h"
#include "widestereo/error.h"
#include "widestereo/matcher.h"

namespace widestereo::test {
namespace {

using ::testing::HasSubstr;

class CudaEmulation : public ::testing::Test {
 protected:
  CudaEmulation() : rig_(fisheye_rig(24)), options_(Options::preset_named("fast")) {
    options_.window_radius = 2;
    options_.sweep_steps = 4;
    options_.levels = 2;
    options_.level_iterations = {1, 1};
    options_.level_regressions = {1, 1};
    for (int i = 0; i < 2; ++i) {
      cv::Mat image;
      smooth_noise({24, 24}, 7).convertTo(image, CV_8U, 255);
      images_.push_back(image);
    }
  }

  void match(const char* on = "cuda") {
    Device device = Device::open(on);
    Matcher matcher(device, rig_, options_);
    matcher.match(images_);
    matcher.match(images_, [](double) {});
  }

  void match_in_application() {
    CudaMatcher matcher(rig_, options_);
    matcher.enqueue(device_images_, maps_, nullptr);
    matcher.enqueue(device_images_, maps_, nullptr);
    matcher.enqueue_next(device_images_, maps_, nullptr);
    cudaDeviceSynchronize();
  }
  /// Acts in another thread while a stream captures that waits for the default stream, as most do;
  /// the capture must not end by that.
  template <class Action>
  void while_a_stream_captures(Action action) {
    cudaStream_t stream = nullptr;
    ASSERT_EQ(cudaStreamCreate(&stream), cudaSuccess);
    ASSERT_EQ(cudaStreamBeginCapture(stream, cudaStreamCaptureModeGlobal), cudaSuccess);
    std::thread(action).join();
    cudaGraph_t graph = nullptr;
    EXPECT_EQ(cudaStreamEndCapture(stream, &graph), cudaSuccess);
    cudaGraphDestroy(graph);
    cudaStreamDestroy(stream);
  }

  /// Every call in turn fails; each failure must be one sentence and leave nothing behind.
  template <class Action>
  void fail_every_call(Action action, cudaError_t failure, bool sticky) {
    const int live = emulation().live_objects;
    emulation().calls = 0;
    action();
    const long calls = emulation().calls;
    ASSERT_GT(calls, 50);
    for (long call = 0; call < calls; ++call) {
      emulation().calls = 0;
      emulation().failure = failure;
      emulation().sticky = sticky;
      emulation().failing_call = call;
      const std::string error = error_of(action);
      emulation().failing_call = -1;
      EXPECT_TRUE(error.empty() || error.back() == '.') << error;
      EXPECT_EQ(emulation().live_objects, live) << call << error;
      EXPECT_EQ(emulation().current_device, 0);
      failures_ += error.empty() ? 0 : 1;
    }
    EXPECT_GE(failures_, calls - 40);  // calls of destructors and of listings may fail unseen
  }

  EmulationScope scope_;
  Rig rig_;
  Options options_;
  std::vector<cv::Mat> images_;
  std::vector<std::uint8_t> memory_ = std::vector<std::uint8_t>(24 * 24, 100);
  const std::array<CudaImage, 2> device_images_ = {CudaImage{memory_.data(), 24, PixelType::grey8},
                                                   CudaImage{memory_.data(), 24, PixelType::grey8}};
  const std::array<CudaViewMaps, 2> maps_ = {};
  long failures_ = 0;
};

TEST_F(CudaEmulation, EveryCallMayRunOutOfMemory) {
  fail_every_call([this] { match(); }, cudaErrorMemoryAllocation, false);
}

TEST_F(CudaEmulation, AnotherDeviceThanTheCurrentOneMayFailAtAnyCall) {
  emulation().devices = 2;
  fail_every_call([this] { match("cuda:1"); }, cudaErrorMemoryAllocation, false);
}

TEST_F(CudaEmulation, ResultsArriveWhereNoMemoryCanBePinned) {
  Device device = Device::open("cuda");
  const StereoResult expected = Matcher(device, rig_, options_).match(images_);
  emulation().can_pin = false;
  const StereoResult result = Matcher(device, rig_, options_).match(images_);
  EXPECT_TRUE(same_bits(result.views[1].hypotheses, expected.views[1].hypotheses));
}

TEST_F(CudaEmulation, TheDeviceMayBeLostAtAnyCall) {
  fail_every_call([this] { match(); }, cudaErrorIllegalAddress, true);
}

TEST_F(CudaEmulation, TheDeviceMayBeLostAtAnyCallOfAnApplication) {
  fail_every_call([this] { match_in_application(); }, cudaErrorIllegalAddress, true);
}

TEST_F(CudaEmulation, OtherThreadsMayCaptureMeanwhile) {
  while_a_stream_captures([this] {
    EXPECT_EQ(error_of([this] {
                match();
                const CudaMatcher matcher(rig_, options_);
              }),
              "");
  });
}

TEST_F(CudaEmulation, TheDefaultStreamIsNotUsedWhileOthersCapture) {
  CudaMatcher matcher(rig_, options_);
  matcher.enqueue(device_images_, maps_, nullptr);
  cudaDeviceSynchronize();
  while_a_stream_captures([&] {
    EXPECT_THAT(error_of([&] { matcher.enqueue(device_images_, maps_, nullptr); }),
                HasSubstr("use a stream of your own"));
    EXPECT_THAT(error_of([&] { matcher.enqueue_next(device_images_, maps_, nullptr); }),
                HasSubstr("use a stream of your own"));
  });
}

TEST_F(CudaEmulation, AMotionThatIsNotAlignedIsRefused) {
  CudaMatcher matcher(rig_, options_);
  matcher.enqueue(device_images_, maps_, nullptr);
  double motion[13] = {};
  const auto* shifted =
      reinterpret_cast<const double*>(reinterpret_cast<const char*>(motion) + sizeof(float));
  EXPECT_THAT(error_of([&] {
                matcher.enqueue_next(device_images_, maps_, nullptr,
                                     {.device_now_from_previous = shifted});
              }),
              HasSubstr("no multiple of 8 bytes"));
  cudaDeviceSynchronize();
}

/// Nothing that a thread writes may be read by another one of the launch: compute-sanitizer looks
/// for races in shared memory alone.
TEST_F(CudaEmulation, TheOrderOfThreadsDoesNotMatter) {
  Device device = Device::open("cuda");
  for (const char* preset : {"paper", "fast", "quality"}) {
    Options options = Options::preset_named(preset);
    options.first_iterations = 2;
    options.sweep_steps = 8;
    options.fill_radius = 8;
    for (const int views : {2, 3}) {
      SCOPED_TRACE(testing::Message() << preset << views);
      Rig rig = fisheye_rig(40);
      std::vector<cv::Mat> images;
      for (int i = 0; i < views; ++i) {
        cv::Mat image;
        smooth_noise({40, 40}, 7).convertTo(image, CV_8U, 255);
        images.push_back(image);
      }
      if (views == 3) {
        rig.views.push_back(rig.views[1]);
        rig.views[2].world_from_camera.translation() *= -0.7;
      }
      const auto results = [&](bool backwards) {
        emulation().backwards = backwards;
        Matcher matcher(device, rig, options);
        matcher.time_kernels(false);
        return std::array{matcher.match(images), matcher.match_next(images, {})};
      };
      const auto forwards = results(false);
      const auto backwards = results(true);
      for (std::size_t frame = 0; frame < 2; ++frame) {
        for (std::size_t i = 0; i < images.size(); ++i) {
          const ViewResult& expected = forwards[frame].views[i];
          const ViewResult& found = backwards[frame].views[i];
          EXPECT_TRUE(same_bits(found.hypotheses, expected.hypotheses));
          EXPECT_TRUE(same_bits(found.confidence, expected.confidence));
          EXPECT_GT(cv::countNonZero(expected.distance), 400);
        }
      }
    }
  }
}

TEST_F(CudaEmulation, AMatcherSurvivesAFailedRun) {
  Device device = Device::open("cuda");
  Matcher matcher(device, rig_, options_);
  const StereoResult expected = matcher.match(images_);
  for (int call = 0; call < 60; ++call) {
    emulation().calls = 0;
    emulation().failure = cudaErrorInvalidValue;
    emulation().failing_call = call;
    EXPECT_THAT(error_of([&] { matcher.match(images_, [](double) {}); }),
                HasSubstr("Emulated GPU could not"));
    emulation().failing_call = -1;
    const StereoResult after = matcher.match(images_);
    EXPECT_TRUE(same_bits(after.views[0].hypotheses, expected.views[0].hypotheses));
  }
}

TEST_F(CudaEmulation, AGraphIsMadeOnceForTheSameSchedule) {
  Device device = Device::open("cuda");
  Matcher matcher(device, rig_, options_);
  for (int i = 0; i < 3; ++i) matcher.match(images_);
  EXPECT_EQ(emulation().graphs_made, 1);
  matcher.match(images_, [](double) {});
  matcher.match(images_);
  EXPECT_EQ(emulation().graphs_made, 1);
}

TEST_F(CudaEmulation, AnotherScheduleMakesAnotherGraph) {
  KernelFixture match(rig_, options_);
  Schedule schedule = match.schedule();
  const std::vector<cv::Size> sizes = sizes_of(schedule.views);
  Device device = Device::open("cuda");
  const auto backend = device.implementation().make_backend(sizes, schedule.constants);
  for (int i = 0; i < static_cast<int>(sizes.size()); ++i) {
    backend->set_rays(i, ray_image(schedule.views[i].camera, {}));
    if (i < 2) backend->set_intensity(i, smooth_noise(sizes[i], 7));
  }
  backend->run(schedule, {});
  const cv::Mat expected = backend->hypotheses(0).clone();
  Schedule other = schedule;
  for (Dispatch& dispatch : other.dispatches) ++dispatch.pass.seed;
  backend->run(other, {});
  EXPECT_FALSE(same_bits(backend->hypotheses(0), expected));
  EXPECT_EQ(emulation().graphs_made, 2);
  other = schedule;
  other.parameters.range.z *= 2;
  backend->run(other, {});
  EXPECT_EQ(emulation().graphs_made, 3);
  EXPECT_FALSE(same_bits(backend->hypotheses(0), expected));
  backend->run(schedule, {});
  EXPECT_EQ(emulation().graphs_made, 3) << "other parameters need no other graph";
  EXPECT_TRUE(same_bits(backend->hypotheses(0), expected));
  other.constants.window_radius = 4;
  EXPECT_THROW(backend->run(other, {}), Error);
}

TEST_F(CudaEmulation, FramesOfAnApplicationAllocateNothing) {
  CudaMatcher matcher(rig_, options_);
  matcher.enqueue(device_images_, maps_, nullptr);
  const int live = emulation().live_objects;
  const int kernels = emulation().kernels_run;
  for (int i = 0; i < 3; ++i) {
    matcher.enqueue(device_images_, maps_, nullptr);
    matcher.enqueue_next(device_images_, maps_, nullptr);
    matcher.enqueue_next(device_images_, maps_, nullptr, {.frame = i});
  }
  EXPECT_EQ(emulation().live_objects, live);
  EXPECT_EQ(emulation().kernels_run, kernels);  // nothing has waited
  cudaDeviceSynchronize();
  EXPECT_GT(emulation().kernels_run, kernels);
}

TEST_F(CudaEmulation, TheCurrentDeviceIsLeftAlone) {
  emulation().devices = 3;
  emulation().current_device = 2;
  Device device = Device::open("cuda:1");
  EXPECT_EQ(device.info().id, "cuda:1");
  Matcher(device, rig_, options_).match(images_);
  CudaMatcher(rig_, options_, 0);
  EXPECT_EQ(emulation().current_device, 2);
}

TEST_F(CudaEmulation, DevicesAreFoundByIndexNameAndUuid) {
  emulation().devices = 2;
  const std::vector<DeviceInfo> devices = list_cuda_devices(nullptr);
  ASSERT_EQ(devices.size(), 2u);
  EXPECT_NE(devices[0].uuid, devices[1].uuid);
  EXPECT_EQ(Device::open("cuda").info().id, "cuda:0");
  EXPECT_EQ(Device::open("cuda:emulated").info().id, "cuda:0");
  EXPECT_EQ(Device::open("cuda:" + devices[1].uuid).info().id, "cuda:1");
  std::string of_nvidia_smi = "GPU-" + devices[1].uuid;
  for (const std::size_t dash : {12, 17, 22, 27}) of_nvidia_smi.insert(dash, "-");
  EXPECT_EQ(Device::open("cuda:" + of_nvidia_smi).info().id, "cuda:1");
  EXPECT_EQ(Device::open("cuda:MIG-" + of_nvidia_smi.substr(4)).info().id, "cuda:1");
  EXPECT_EQ(Device::open("auto").info().id, "cuda:0");
  EXPECT_EQ(Device::list().front().id, "cuda:0");
  EXPECT_THAT(error_of([] { Device::open("cuda:7"); }), HasSubstr("cuda:1 (Emulated GPU)"));
}

TEST_F(CudaEmulation, ADeviceThatIsTakenIsPassedOver) {
  emulation().devices = 2;
  int passed_over = 0;  // by whichever call finds the first one taken
  for (int call = 0; call < 60; ++call) {
    emulation().calls = 0;
    emulation().failure = cudaErrorDevicesUnavailable;
    emulation().failing_call = call;
    for (const char* name : {"cuda", "auto"}) {
      try {
        const Device device = Device::open(name);
        const bool says_why = device.note().find("it is busy") != std::string::npos;
        passed_over += device.info().id == "cuda:1" && says_why ? 1 : 0;
      } catch (const Error&) {
        // Some calls are about all devices.
      }
    }
  }
  EXPECT_GE(passed_over, 4);
  emulation().failing_call = -1;
  emulation().compute_mode = cudaComputeModeProhibited;
  EXPECT_THAT(error_of([] { Device::open("cuda"); }), HasSubstr("nvidia-smi"));
}

TEST_F(CudaEmulation, DigitsOfANameAreNoIndex) {
  emulation().devices = 2;
  emulation().name = "NVIDIA H100 80GB";
  EXPECT_EQ(Device::open("cuda:1").info().id, "cuda:1");
  EXPECT_EQ(Device::open("cuda:h100").info().id, "cuda:0");
  EXPECT_THAT(error_of([] { Device::open("cuda:100"); }),
              HasSubstr("No CUDA device is called \"100\"; there are: cuda:0 (NVIDIA H100 80GB)"));
  // A name that holds the other device's UUID.
  const std::string uuid = list_cuda_devices(nullptr)[1].uuid;
  emulation().name = uuid.c_str();
  EXPECT_EQ(Device::open("cuda:" + uuid).info().id, "cuda:1");
}

TEST_F(CudaEmulation, DevicesStateTheirPeaks) {
  const DevicePeaks h200 = Device::open("cuda").info().peaks;
  EXPECT_NEAR(h200.gflops, 66908, 1);  // as NVIDIA's data sheet: 67 TFLOP/s
  EXPECT_NEAR(h200.gtexels, 4182, 1);
  EXPECT_NEAR(h200.gbps, 4917, 1);  // ... 4.8 TB/s
  emulation().major = 99;
  EXPECT_EQ(list_cuda_devices(nullptr)[0].peaks.gflops, 0) << "lanes unknown";
}

TEST_F(CudaEmulation, UnusableDevicesSayWhy) {
  emulation().major = 5;
  EXPECT_THAT(error_of([] { Device::open("cuda"); }), HasSubstr("compute capability 5.0"));
  EXPECT_THAT(Device::open("auto").note(), HasSubstr("compute capability 5.0"));
  emulation().major = 9;
  emulation().compute_mode = cudaComputeModeProhibited;
  EXPECT_THAT(error_of([] { Device::open("cuda:0"); }), HasSubstr("nvidia-smi -c 0"));
  // As of architectures that CMake's words leave open, or of a driver older than the PTX.
  emulation().compute_mode = cudaComputeModeDefault;
  emulation().has_kernels = false;
  EXPECT_THAT(error_of([] { Device::open("cuda"); }), HasSubstr("no kernels for its architecture"));
  EXPECT_THAT(Device::open("auto").note(), HasSubstr("no kernels for its architecture"));
}

TEST_F(CudaEmulation, MissingDevicesSayWhyAndAutoOnlyWithADriver) {
  emulation().count_error = cudaErrorInsufficientDriver;
  emulation().driver_version = 11020;
  EXPECT_THAT(error_of([] { Device::open("cuda"); }), HasSubstr("too old: it knows CUDA 11.2"));
  EXPECT_THAT(Device::open("auto").note(), HasSubstr("too old"));
  emulation().driver_version = 0;
  EXPECT_THAT(error_of([] { Device::open("cuda"); }), HasSubstr("no NVIDIA driver"));
  EXPECT_THAT(Device::open("auto").note(), ::testing::Not(HasSubstr("CUDA")));
  emulation().count_error = cudaErrorNoDevice;
  emulation().driver_version = 12040;
  EXPECT_THAT(error_of([] { Device::open("cuda"); }), HasSubstr("CUDA_VISIBLE_DEVICES"));
}

TEST_F(CudaEmulation, SplitsWhereADisplayLimitsTheTime) {
  EXPECT_EQ(cuda_target(0, {}).max_samples, 0) << "no limit";
  emulation().time_limit = true;
  EXPECT_GT(cuda_target(0, {}).max_samples, 0);
  const auto kernels_of_match = [&](long max_samples) {
    DeviceRequest request;
    request.device = "cuda";
    request.max_samples_per_dispatch = max_samples;
    EXPECT_EQ(cuda_target(0, request).max_samples, max_samples);
    Device device = Device::open(request);
    Matcher matcher(device, rig_, options_);
    const int before = emulation().kernels_run;
    matcher.match(images_);
    return emulation().kernels_run - before;
  };
  const int whole = kernels_of_match(1'000'000'000);
  EXPECT_EQ(whole, static_cast<int>(make_schedule(rig_, options_).dispatches.size()));
  EXPECT_GT(kernels_of_match(5000), whole);
}

}  // namespace
}  // namespace widestereo::test
