// SPDX-License-Identifier: MIT
// What of the CUDA back end can be tested without a GPU: devices that are not there, architectures,
// conversions, launches.
#include "widestereo/cuda.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "cuda/architectures.h"
#include "cuda/cuda_device.h"
#include "error_of.h"
#include "kernel/kernel_fixture.h"
#include "kernel/maps.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

#ifdef WIDESTEREO_HAS_CUDA
#include <cuda_runtime_api.h>

#include "cuda/launch.h"
#include "cuda/result.h"
#endif

namespace widestereo::test {
namespace {

using ::testing::HasSubstr;

TEST(CudaDevices, AreDescribedOrTheirAbsenceIsExplained) {
  std::string why;
  const std::vector<DeviceInfo> devices = list_cuda_devices(&why);
  EXPECT_EQ(devices.empty(), !why.empty());
  EXPECT_EQ(Device::why_none(DeviceKind::cuda), why);
  if (!why.empty()) {
    EXPECT_EQ(why.back(), '.') << why;
    EXPECT_EQ(error_of([] { open_cuda_device(0, {}); }), "No CUDA device: " + why);
    EXPECT_THAT(error_of([] { Device::open("cuda"); }), HasSubstr(why));
    EXPECT_THAT(error_of([] { Device::open("cuda:0"); }), HasSubstr(why));
  }
  for (std::size_t i = 0; i < devices.size(); ++i) {
    EXPECT_EQ(devices[i].kind, DeviceKind::cuda);
    EXPECT_EQ(devices[i].id, "cuda:" + std::to_string(i));
    EXPECT_FALSE(devices[i].name.empty());
    EXPECT_EQ(devices[i].uuid.size(), 32u);
    EXPECT_EQ(devices[i].uuid.find_first_not_of("0123456789abcdef"), std::string::npos);
    EXPECT_THAT(devices[i].driver, HasSubstr("compute capability"));
  }
  EXPECT_NE(error_of([] { open_cuda_device(1000, {}); }), "");
  EXPECT_NE(error_of([] { open_cuda_device(-1, {}); }), "");
}

TEST(CudaDevices, AutoDoesNotTalkOfCudaWithoutADriver) {
  const Device device = Device::open("auto");
  if (!cuda_driver_found()) {
    EXPECT_NE(device.info().kind, DeviceKind::cuda);
    EXPECT_THAT(device.note(), ::testing::Not(HasSubstr("CUDA")));
  } else if (!list_cuda_devices(nullptr).empty() && device.note().empty()) {
    EXPECT_EQ(device.info().kind, DeviceKind::cuda);
  }
}

TEST(CudaDevices, ComeFirstInTheList) {
  const std::vector<DeviceInfo> devices = Device::list();
  const std::vector<DeviceInfo> of_cuda = list_cuda_devices(nullptr);
  const bool any = std::any_of(of_cuda.begin(), of_cuda.end(),
                               [](const DeviceInfo& device) { return device.unusable.empty(); });
  EXPECT_EQ(devices[0].kind == DeviceKind::cuda, any);
}

TEST(CudaArchitectures, RunWhereTheyWereBuiltFor) {
  const std::string usual = "75-real 80 86-real 89-real 90";
  EXPECT_FALSE(runs_on(usual, 5, 2));
  EXPECT_FALSE(runs_on(usual, 7, 0));
  EXPECT_TRUE(runs_on(usual, 7, 5));
  EXPECT_TRUE(runs_on(usual, 8, 0));
  EXPECT_TRUE(runs_on(usual, 8, 7));
  EXPECT_TRUE(runs_on(usual, 9, 0));
  EXPECT_TRUE(runs_on(usual, 10, 0));
  EXPECT_TRUE(runs_on(usual, 12, 1));
  EXPECT_FALSE(runs_on("86-real", 8, 0));
  EXPECT_TRUE(runs_on("86-real", 8, 9));
  EXPECT_FALSE(runs_on("86-real", 9, 0));
  EXPECT_TRUE(runs_on("75", 12, 0));
  for (const char* of_family : {"100f", "100f-real", "100f-virtual"}) {
    EXPECT_TRUE(runs_on(of_family, 10, 3)) << of_family;
    EXPECT_FALSE(runs_on(of_family, 12, 0)) << of_family;
  }
  EXPECT_TRUE(runs_on("75;80", 8, 6));
  EXPECT_TRUE(runs_on("75-virtual", 8, 6));
  EXPECT_FALSE(runs_on("75-virtual", 7, 0));
  EXPECT_TRUE(runs_on("90a-real", 9, 0));
  EXPECT_FALSE(runs_on("90a-real", 9, 1));
  EXPECT_FALSE(runs_on("90a-real", 10, 0));
  EXPECT_TRUE(runs_on("120-real", 12, 1));
  EXPECT_TRUE(runs_on("native", 8, 6));
  EXPECT_FALSE(runs_on("", 8, 6));
}

TEST(CudaMaps, IntensitiesEqualTheMatchersBitByBit) {
  cv::Mat grey8(1, 256, CV_8UC1);
  for (int i = 0; i < 256; ++i) grey8.at<uchar>(0, i) = static_cast<uchar>(i);
  const cv::Mat expected8 = to_intensity(grey8, "test");
  for (int i = 0; i < 256; ++i) {
    EXPECT_EQ(static_cast<float>(i) * SCALE_OF_8_BITS, expected8.at<float>(0, i));
  }
  cv::Mat grey16(256, 256, CV_16UC1);
  for (int i = 0; i < 65536; ++i) grey16.at<ushort>(i / 256, i % 256) = static_cast<ushort>(i);
  const cv::Mat expected16 = to_intensity(grey16, "test");
  for (int i = 0; i < 65536; ++i) {
    ASSERT_EQ(static_cast<float>(i) * SCALE_OF_16_BITS, expected16.at<float>(i / 256, i % 256));
  }
  EXPECT_GT(ABOVE_INTENSITY, 1.0f);
}

TEST(TextureColours, OfGreyKeepItsBits) {
  for (int i = 0; i < 65536; ++i) {
    const float grey = static_cast<float>(i) * SCALE_OF_16_BITS;
    ASSERT_EQ(kernel::luma(grey, grey, grey), grey);
  }
  EXPECT_NEAR(kernel::luma(1, 0, 0), 0.299, 1e-6);
  EXPECT_NEAR(kernel::luma(0, 1, 0), 0.587, 1e-6);
  EXPECT_NEAR(kernel::luma(0, 0, 1), 0.114, 1e-6);
}

TEST(CudaMaps, DistancesAndNormalsOfPlanes) {
  const Eigen::Vector3d normal = Eigen::Vector3d(0.3, -0.4, -1).normalized();
  const Eigen::Vector3d ray = Eigen::Vector3d(0.1, 0.5, 0.7).normalized();
  const double distance = 3.7;
  const Eigen::Vector3d m = normal / normal.dot(distance * ray);
  const auto single = [](double value) { return static_cast<float>(value); };
  const kernel::vec4 unit_ray(single(ray.x()), single(ray.y()), single(ray.z()), 1);
  kernel::vec4 plane(single(m.x()), single(m.y()), single(m.z()), 0.5f);
  EXPECT_NEAR(kernel::plane_distance(plane, unit_ray), distance, 1e-5);
  const kernel::vec3 n = kernel::plane_normal(plane, unit_ray);
  EXPECT_NEAR(n.x, normal.x(), 1e-6);
  EXPECT_NEAR(n.y, normal.y(), 1e-6);
  EXPECT_NEAR(n.z, normal.z(), 1e-6);
  plane.w = INVALID_COST;
  EXPECT_EQ(kernel::plane_distance(plane, unit_ray), 0);
  const kernel::vec3 none = kernel::plane_normal(plane, unit_ray);
  EXPECT_EQ(std::abs(none.x) + std::abs(none.y) + std::abs(none.z), 0);
  EXPECT_EQ(kernel::plane_distance({0, 0, 0, 0.5f}, unit_ray), 0);
  EXPECT_EQ(kernel::plane_distance({0, 0, -1, 0.5f}, unit_ray), 0);
}

TEST(CudaMatcherErrors, MissingDevicesAndBadRigsAreOneSentence) {
  Options options;
  const Rig rig = fisheye_rig(32);
  std::string why;
  if (list_cuda_devices(&why).empty()) {
    EXPECT_EQ(error_of([&] { CudaMatcher(rig, options); }), "No CUDA device: " + why);
  }
  Rig alone = rig;
  alone.views.pop_back();
  EXPECT_NE(error_of([&] { CudaMatcher(alone, options, 0); }), "");
  EXPECT_NE(error_of([&] { CudaMatcher(rig, options, 1000); }), "");
}

#ifdef WIDESTEREO_HAS_CUDA

constexpr std::size_t oldest_argument_limit = 4096;  // bytes of arguments before CUDA 12.1
static_assert(sizeof(kernel::cuda::Context) <= oldest_argument_limit);
static_assert(sizeof(kernel::MatchParameters) > oldest_argument_limit);
static_assert(alignof(kernel::vec4) == 16);

TEST(CudaLaunches, GridsCoverEveryPixelOnce) {
  for (const int width : {1, 2, 15, 16, 17, 31, 32, 33, 640}) {
    for (const int rows : {1, 7, 8, 9, 480}) {
      for (const int colour : {-1, 0, 1}) {
        const LaunchGrid grid = launch_grid(width, rows, colour);
        const int threads_per_row = static_cast<int>(grid.columns) * kernel::cuda::block_width;
        const int threads_per_column = static_cast<int>(grid.rows) * kernel::cuda::block_height;
        EXPECT_GE(threads_per_row * (colour < 0 ? 1 : 2), width);
        EXPECT_LT(threads_per_row - kernel::cuda::block_width, width);
        EXPECT_GE(threads_per_column, rows);
        EXPECT_LT(threads_per_column - kernel::cuda::block_height, rows);
      }
    }
  }
}

TEST(CudaLaunches, EveryKernelHasAnEntryPoint) {
  for (int i = 0; i < kernel_count; ++i) {
    const auto kernel = static_cast<Kernel>(i);
    if (kernel == Kernel::iterate_raster) {
      EXPECT_THAT(error_of([&] { kernel_function(kernel, {}); }), HasSubstr("iterate_raster"));
    } else {
      EXPECT_NE(kernel_function(kernel, {}), nullptr) << to_string(kernel);
    }
  }
}

TEST(CudaLaunches, PresetsAndModelsHaveKernelsOfTheirOwn) {
  const KernelConstants other{.window_radius = 3};
  for (const std::string& preset : Options::preset_names()) {
    Rig rig = fisheye_rig(32);
    const Options options = Options::preset_named(preset);
    const Kernel kernel = preset == "paper" ? Kernel::iterate : Kernel::search;
    const void* double_sphere = kernel_function(kernel, make_schedule(rig, options).constants);
    for (View& view : rig.views) {
      view.camera.model = CameraModel::unified;
      view.camera.xi = 1.2;
    }
    const void* any_model = kernel_function(kernel, make_schedule(rig, options).constants);
    EXPECT_NE(double_sphere, any_model) << preset;
    EXPECT_NE(double_sphere, kernel_function(kernel, other)) << preset;
    EXPECT_NE(any_model, kernel_function(kernel, other)) << preset;
  }
}

TEST(CudaErrors, NameDeviceActionAndRemedy) {
  EXPECT_NO_THROW(check(cudaSuccess, "GPU", "work"));
  const std::string memory = error_of([] { check(cudaErrorMemoryAllocation, "GPU", "allocate"); });
  EXPECT_THAT(memory, HasSubstr("GPU could not allocate: out of memory; use smaller"));
  EXPECT_THAT(explain(cudaErrorIllegalAddress), HasSubstr("lost"));
  EXPECT_THAT(explain(cudaErrorNoKernelImageForDevice), HasSubstr("CMAKE_CUDA_ARCHITECTURES"));
  for (const cudaError_t error :
       {cudaErrorMemoryAllocation, cudaErrorLaunchTimeout, cudaErrorUnknown, cudaErrorInvalidValue,
        cudaErrorDevicesUnavailable, cudaErrorSystemDriverMismatch}) {
    EXPECT_EQ(explain(error).back(), '.') << explain(error);
  }
}

#endif

}  // namespace
}  // namespace widestereo::test
