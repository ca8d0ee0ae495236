// SPDX-License-Identifier: MIT
// Matches on a CUDA device; skipped without one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <opencv2/core.hpp>
#include <optional>

#include "device_fixture.h"
#include "match_fixture.h"
#include "matching/backend.h"
#include "pixel_fixture.h"
#include "same_bits.h"
#include "vulkan_fixture.h"
#include "widestereo/cuda.h"
#include "widestereo/matcher.h"

#ifdef WIDESTEREO_HAS_CUDA
#include <cuda_runtime_api.h>

namespace widestereo::test {
namespace {

using ::testing::HasSubstr;

#define CUDA_OK(call) ASSERT_EQ(call, cudaSuccess)

std::vector<Options> every_method() {
  std::vector<Options> list;
  for (const std::string& preset : Options::preset_names()) {
    Options options = Options::preset_named(preset);
    std::tie(options.min_distance, options.max_distance) = demo_distance_range();
    options.first_iterations = 3;
    options.second_iterations = 2;
    options.sweep_steps = 24;
    list.push_back(options);
  }
  list.back().window_radius = 3;  // no kernels of its own
  return list;
}

TEST(CudaMatch, BitsDependNeitherOnGraphsNorOnSplitting) {
  OPEN_DEVICE_OR_SKIP(device, "cuda");
  const RenderedPair pair = render_demo(65);
  for (const Options& options : every_method()) {
    Matcher matcher(*device, pair.rig, options);
    const StereoResult first = matcher.match(images_of(pair));
    expect_same_bits(first, matcher.match(images_of(pair)));  // the same graph again
    double done = 0;
    const StereoResult watched =
        matcher.match(images_of(pair), [&done](double share) { done = share; });
    EXPECT_DOUBLE_EQ(done, 1);
    expect_same_bits(first, watched);
    expect_same_bits(first, matcher.match(images_of(pair)));
    Device splitting = open_validated("cuda", 5000);
    expect_same_bits(first, Matcher(splitting, pair.rig, options).match(images_of(pair)));
  }
}

TEST(CudaMatch, TimesEveryKernelInBothWaysAndTurns) {
  OPEN_DEVICE_OR_SKIP(device, "cuda");
  const RenderedPair pair = render_demo(128);
  for (const Options& options : every_method()) {
    Matcher matcher(*device, pair.rig, options);
    const StereoResult graph = matcher.match(images_of(pair));
    const StereoResult watched = matcher.match(images_of(pair), [](double) {});
    const StereoResult graph_again = matcher.match(images_of(pair));
    for (const StereoResult* result : {&graph, &watched, &graph_again}) {
      ASSERT_EQ(result->times.size(), graph.times.size());
      double total = 0;
      for (std::size_t i = 0; i < graph.times.size(); ++i) {
        EXPECT_EQ(result->times[i].kernel, graph.times[i].kernel);
        EXPECT_EQ(result->times[i].dispatches, graph.times[i].dispatches);
        EXPECT_GT(result->times[i].milliseconds, 0) << graph.times[i].kernel;
        total += result->times[i].milliseconds;
      }
      EXPECT_LT(total, result->milliseconds);
    }
    EXPECT_GT(graph.device_bytes, 128u * 128u * 2u * 68u);
    matcher.time_kernels(false);
    const StereoResult untimed = matcher.match(images_of(pair));
    expect_same_bits(untimed, graph);
    EXPECT_GT(untimed.device_milliseconds, 0);
    EXPECT_LT(untimed.device_milliseconds, untimed.milliseconds);
    ASSERT_EQ(untimed.times.size(), graph.times.size());
    for (const KernelTime& time : untimed.times) EXPECT_EQ(time.milliseconds, 0) << time.kernel;
  }
}

TEST(CudaMatch, AnAbortedRunLeavesTheMatcherUsable) {
  OPEN_DEVICE_OR_SKIP(device, "cuda");
  const RenderedPair pair = render_demo(96);
  Matcher matcher(*device, pair.rig, every_method()[0]);
  const StereoResult first = matcher.match(images_of(pair));
  EXPECT_THROW(matcher.match(images_of(pair), [](double) { throw Error("stop"); }), Error);
  expect_same_bits(first, matcher.match(images_of(pair)));
}

TEST(CudaMatch, MatchersLeaveNoMemoryBehind) {
  OPEN_DEVICE_OR_SKIP(device, "cuda");
  const RenderedPair pair = render_demo(96);
  std::size_t before = 0;
  std::size_t after = 0;
  std::size_t total = 0;
  for (int i = 0; i < 12; ++i) {
    Matcher(*device, pair.rig, every_method()[0]).match(images_of(pair));
    if (i == 1) {  // kernels are loaded by now
      CUDA_OK(cudaMemGetInfo(&before, &total));
    }
  }
  CUDA_OK(cudaMemGetInfo(&after, &total));
  const std::size_t of_others = 4u << 20;  // ten matchers would be 16 MiB
  EXPECT_LE(before, after + of_others);
}

TEST(CudaMatch, TooLittleMemoryIsAnErrorThatLeavesTheDeviceUsable) {
  OPEN_DEVICE_OR_SKIP(device, "cuda");
  std::size_t available = 0;
  std::size_t total = 0;
  CUDA_OK(cudaMemGetInfo(&available, &total));
  // 68 bytes a pixel do not fit twice where one view's rays alone take all there is.
  const int side = static_cast<int>(std::sqrt(static_cast<double>(total) / 16));
  const std::vector<cv::Size> sizes(4, cv::Size(side, side));
  const std::string error =
      error_of([&] { device->implementation().make_backend(sizes, KernelConstants{}); });
  EXPECT_THAT(error, HasSubstr("out of memory"));
  EXPECT_THAT(error, HasSubstr(device->info().name));
  const RenderedPair pair = render_demo(96);
  EXPECT_NO_THROW(Matcher(*device, pair.rig, every_method()[0]).match(images_of(pair)));
}

/// Pitched device memory, its rows padded beyond what was asked for.
class Pitched {
 public:
  Pitched(cv::Size size, int type) : size_(size), type_(type) {
    cudaMallocPitch(&data_, &pitch_, static_cast<std::size_t>(size.width) * CV_ELEM_SIZE(type),
                    static_cast<std::size_t>(size.height));
  }
  ~Pitched() { cudaFree(data_); }
  Pitched(const Pitched&) = delete;

  void upload(const cv::Mat& map) {
    cudaMemcpy2D(data_, pitch_, map.data, map.step[0], map.cols * map.elemSize(),
                 static_cast<std::size_t>(map.rows), cudaMemcpyHostToDevice);
  }
  cv::Mat download() const {
    cv::Mat map(size_, type_);
    cudaMemcpy2D(map.data, map.step[0], data_, pitch_, map.cols * map.elemSize(),
                 static_cast<std::size_t>(map.rows), cudaMemcpyDeviceToHost);
    return map;
  }
  template <class T>
  CudaMap<T> map() const {
    return {static_cast<T*>(data_), pitch_};
  }
  CudaImage image(PixelType pixel) const { return {data_, pitch_, pixel}; }

 private:
  cv::Size size_;
  int type_;
  void* data_ = nullptr;
  std::size_t pitch_ = 0;
};

/// All maps of one view in device memory.
struct DeviceMaps {
  explicit DeviceMaps(cv::Size size)
      : distance(size, CV_32FC1),
        normals(size, CV_32FC3),
        cost(size, CV_32FC1),
        confidence(size, CV_32FC1),
        reasons(size, CV_16UC1) {}
  CudaViewMaps maps() const {
    return {distance.map<float>(), normals.map<float>(), cost.map<float>(), confidence.map<float>(),
            reasons.map<std::uint16_t>()};
  }
  void expect_equal(const ViewResult& expected) const {
    EXPECT_TRUE(same_bits(distance.download(), expected.distance));
    EXPECT_TRUE(same_bits(normals.download(), expected.normals));
    EXPECT_TRUE(same_bits(cost.download(), expected.cost));
    EXPECT_TRUE(same_bits(confidence.download(), expected.confidence));
    EXPECT_TRUE(same_bits(reasons.download(), expected.reasons));
  }
  Pitched distance, normals, cost, confidence, reasons;
};

class CudaApplication : public ::testing::TestWithParam<PixelType> {};

TEST_P(CudaApplication, GetsTheMatchersResultOnItsOwnStream) {
  OPEN_DEVICE_OR_SKIP(device, "cuda:0");
  RenderedPair pair = render_demo(65);
  const cv::Size size(65, 65);
  cv::Mat mask(size, CV_8UC1, cv::Scalar(1));
  mask(cv::Rect(20, 30, 15, 10)).setTo(0);
  pair.rig.views[1].mask = mask;
  const std::vector<cv::Mat> images = device_images_of(pair, GetParam());
  Pitched left(size, images[0].type());
  Pitched right(size, images[1].type());
  left.upload(images[0]);
  right.upload(images[1]);
  CUDA_OK(cudaDeviceSynchronize());
  const CudaImage inputs[] = {left.image(GetParam()), right.image(GetParam())};
  cudaStream_t stream = nullptr;
  CUDA_OK(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
  for (const Options& options : every_method()) {
    const StereoResult expected = Matcher(*device, pair.rig, options).match(images);
    for (const int ordinal : {CudaMatcher::current_device, 0}) {
      CudaMatcher matcher(pair.rig, options, ordinal);
      EXPECT_EQ(matcher.filter(), expected.filter);
      const DeviceMaps first(size);
      const DeviceMaps second(size);
      const CudaViewMaps outputs[] = {first.maps(), second.maps()};
      for (int frame = 0; frame < 2; ++frame) matcher.enqueue(inputs, outputs, stream);
      CUDA_OK(cudaStreamSynchronize(stream));
      first.expect_equal(expected.views[0]);
      second.expect_equal(expected.views[1]);
    }
  }
  CUDA_OK(cudaStreamDestroy(stream));
}

INSTANTIATE_TEST_SUITE_P(Pixels, CudaApplication,
                         ::testing::Values(PixelType::grey8, PixelType::grey16,
                                           PixelType::intensity),
                         name_of);

TEST(CudaApplication, MayCaptureAMatch) {
  OPEN_DEVICE_OR_SKIP(device, "cuda:0");
  const RenderedPair pair = render_demo(96);
  const cv::Size size(96, 96);
  const Options options = every_method()[0];
  std::vector<cv::Mat> images;
  for (const RenderedView& view : pair.views) images.push_back(to_intensity(view.image, "test"));
  Pitched left(size, CV_32FC1);
  Pitched right(size, CV_32FC1);
  left.upload(images[0]);
  right.upload(images[1]);
  CudaMatcher matcher(pair.rig, options);
  const DeviceMaps maps(size);
  const CudaImage inputs[] = {left.image(PixelType::intensity), right.image(PixelType::intensity)};
  const CudaViewMaps outputs[] = {maps.maps(), {}};
  cudaStream_t stream = nullptr;
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t exec = nullptr;
  CUDA_OK(cudaStreamCreate(&stream));
  CUDA_OK(cudaStreamBeginCapture(stream, cudaStreamCaptureModeGlobal));
  matcher.enqueue(inputs, outputs, stream);
  CUDA_OK(cudaStreamEndCapture(stream, &graph));
  CUDA_OK(cudaGraphInstantiateWithFlags(&exec, graph, 0));
  CUDA_OK(cudaGraphLaunch(exec, stream));
  CUDA_OK(cudaStreamSynchronize(stream));
  maps.expect_equal(Matcher(*device, pair.rig, options).match(images).views[0]);
  CUDA_OK(cudaGraphExecDestroy(exec));
  CUDA_OK(cudaGraphDestroy(graph));
  CUDA_OK(cudaStreamDestroy(stream));
}

/// Three frames of the demo scene from a moving rig, and a CUDA application that matches them.
class CudaSequence : public ::testing::Test {
 protected:
  static constexpr int side = 65;

  CudaSequence()
      : size_(side, side), left_(size_, CV_32FC1), right_(size_, CV_32FC1), maps_(size_) {
    for (int k = 0; k < 3; ++k) {
      const RenderedPair pair = render_demo_from(pose_after(k), side);
      rig_ = pair.rig;
      std::vector<cv::Mat>& images = frames_.emplace_back();
      for (const RenderedView& view : pair.views)
        images.push_back(to_intensity(view.image, "test"));
    }
    // Another frame of reference than camera 0, so that the cameras' poses in the rig count.
    const Eigen::Isometry3d turned(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()));
    for (View& view : rig_.views) view.world_from_camera = turned * view.world_from_camera;
    for (Eigen::Isometry3d* motion : {&motions_[0], &motions_[1]}) {
      const int k = motion == &motions_[0] ? 1 : 2;
      *motion = turned * pose_after(k).inverse() * pose_after(k - 1) * turned.inverse();
    }
  }

  void upload(int frame) {
    left_.upload(frames_[static_cast<std::size_t>(frame)][0]);
    right_.upload(frames_[static_cast<std::size_t>(frame)][1]);
    cudaDeviceSynchronize();
  }
  std::array<CudaImage, 2> images() const {
    return {left_.image(PixelType::intensity), right_.image(PixelType::intensity)};
  }
  std::array<CudaViewMaps, 2> outputs() const { return {maps_.maps(), CudaViewMaps{}}; }

  /// What a Matcher finds in the frames, each but the first started from the one before.
  std::vector<StereoResult> expected(Device& device, const Options& options) {
    Matcher matcher(device, rig_, options);
    std::vector<StereoResult> results = {matcher.match(frames_[0])};
    for (int k = 1; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      results.push_back(
          matcher.match_next(frames_[i], {.now_from_previous = motions_[i - 1], .frame = k}));
    }
    return results;
  }

  cv::Size size_;
  Rig rig_;
  std::vector<std::vector<cv::Mat>> frames_;
  std::array<Eigen::Isometry3d, 2> motions_;
  Pitched left_, right_;
  DeviceMaps maps_;
};

TEST_F(CudaSequence, StartsFromTheLastFrameAsTheMatcherDoes) {
  OPEN_DEVICE_OR_SKIP(device, "cuda:0");
  for (const Options& options : every_method()) {
    const std::vector<StereoResult> results = expected(*device, options);
    CudaMatcher matcher(rig_, options);
    for (int repetition = 0; repetition < 2; ++repetition) {
      upload(0);
      matcher.enqueue(images(), outputs(), nullptr);
      CUDA_OK(cudaDeviceSynchronize());
      maps_.expect_equal(results[0].views[0]);
      for (int k = 1; k < 3; ++k) {
        upload(k);
        const auto i = static_cast<std::size_t>(k);
        CudaWarmStart start{.now_from_previous = motions_[i - 1]};
        if (repetition > 0) start.frame = k;  // else it is counted
        matcher.enqueue_next(images(), outputs(), nullptr, start);
        CUDA_OK(cudaDeviceSynchronize());
        maps_.expect_equal(results[i].views[0]);
      }
    }
  }
}

TEST_F(CudaSequence, ACapturedWarmStartFollowsTheMotionAndCountsOn) {
  OPEN_DEVICE_OR_SKIP(device, "cuda:0");
  const Options options = every_method()[0];
  const std::vector<StereoResult> results = expected(*device, options);
  CudaMatcher matcher(rig_, options);
  upload(0);
  matcher.enqueue(images(), outputs(), nullptr);
  Pitched motion({12, 1}, CV_64FC1);
  cudaStream_t stream = nullptr;
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t exec = nullptr;
  CUDA_OK(cudaDeviceSynchronize());
  CUDA_OK(cudaStreamCreate(&stream));
  CUDA_OK(cudaStreamBeginCapture(stream, cudaStreamCaptureModeGlobal));
  matcher.enqueue_next(images(), outputs(), stream,
                       {.device_now_from_previous = motion.map<double>().data});
  CUDA_OK(cudaStreamEndCapture(stream, &graph));
  CUDA_OK(cudaGraphInstantiateWithFlags(&exec, graph, 0));
  for (int k = 1; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    cv::Mat_<double> rows(1, 12);
    for (int j = 0; j < 12; ++j) rows(0, j) = motions_[i - 1].matrix()(j / 4, j % 4);
    motion.upload(rows);
    upload(k);
    CUDA_OK(cudaGraphLaunch(exec, stream));
    CUDA_OK(cudaStreamSynchronize(stream));
    // Motions are put together on the device, whose last bit may differ.
    const cv::Mat difference = cv::abs(maps_.distance.download() - results[i].views[0].distance) >
                               1e-3 * results[i].views[0].distance;
    EXPECT_LT(cv::countNonZero(difference), side * side / 100) << k;
  }
  CUDA_OK(cudaGraphExecDestroy(exec));
  CUDA_OK(cudaGraphDestroy(graph));
  CUDA_OK(cudaStreamDestroy(stream));
}

TEST_F(CudaSequence, NeedsAFrameToStartFrom) {
  OPEN_DEVICE_OR_SKIP(device, "cuda:0");
  CudaMatcher matcher(rig_, every_method()[0]);
  EXPECT_THAT(error_of([&] { matcher.enqueue_next(images(), outputs(), nullptr); }),
              HasSubstr("no planes of a previous frame"));
  upload(0);
  matcher.enqueue(images(), outputs(), nullptr);
  EXPECT_THAT(error_of([&] {
                const CudaImage one[] = {left_.image(PixelType::intensity)};
                matcher.enqueue_next(one, outputs(), nullptr);
              }),
              HasSubstr("2 views"));
}

TEST(CudaApplication, RefusesWhatDoesNotFit) {
  OPEN_DEVICE_OR_SKIP(device, "cuda:0");
  const RenderedPair pair = render_demo(96);
  CudaMatcher matcher(pair.rig, every_method()[0]);
  const Pitched memory({96, 96}, CV_32FC1);
  const CudaImage good = memory.image(PixelType::intensity);
  const auto error = [&](CudaImage right, CudaMap<float> distance) {
    const CudaImage images[] = {good, right};
    CudaViewMaps maps[2];
    maps[0].distance = distance;
    return error_of([&] { matcher.enqueue(images, maps, nullptr); });
  };
  EXPECT_THAT(error({nullptr, good.pitch, PixelType::intensity}, {}), HasSubstr("cam1"));
  EXPECT_THAT(error({good.data, 96, PixelType::intensity}, {}), HasSubstr("pitch"));
  EXPECT_THAT(error({good.data, 385, PixelType::intensity}, {}), HasSubstr("multiples of 4"));
  EXPECT_THAT(error(good, {memory.map<float>().data, 100}), HasSubstr("distance map of cam0"));
  const CudaImage one[] = {good};
  EXPECT_THAT(error_of([&] { matcher.enqueue(one, {}, nullptr); }), HasSubstr("2 views"));
}

}  // namespace
}  // namespace widestereo::test

#endif
