// SPDX-License-Identifier: MIT
#include "io/frame_images.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "io/frame_times.h"
#include "widestereo/sequence.h"

namespace widestereo {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// A whole number, or one character.
std::string_view first_part(std::string_view text) {
  if (!is_digit(text.front())) return text.substr(0, 1);
  const auto end = std::find_if_not(text.begin(), text.end(), is_digit);
  return text.substr(0, static_cast<std::size_t>(end - text.begin()));
}

/// Without the zeros before it.
std::string_view significant(std::string_view number) {
  return number.substr(std::min(number.find_first_not_of('0'), number.size() - 1));
}

/// Of any length.
int compare_numbers(std::string_view a, std::string_view b) {
  a = significant(a);
  b = significant(b);
  return a.size() != b.size() ? (a.size() < b.size() ? -1 : 1) : a.compare(b);
}

/// A name's numbers, and what is between them.
struct NumbersInName {
  std::vector<std::string> numbers;
  std::string between;

  explicit NumbersInName(std::string_view name) {
    while (!name.empty()) {
      const std::string_view part = first_part(name);
      const bool is_number = is_digit(part.front());
      if (is_number) numbers.emplace_back(part);
      between += is_number ? '0' : part.front();
      name.remove_prefix(part.size());
    }
  }
};

/// Which numbers differ between names that are alike otherwise; of a single one the last. None
/// where they are not.
std::vector<std::size_t> differing_numbers(const std::vector<NumbersInName>& names) {
  const NumbersInName& first = names.front();
  if (first.numbers.empty()) return {};
  if (names.size() == 1) return {first.numbers.size() - 1};
  std::vector<std::size_t> differing;
  for (const NumbersInName& name : names) {
    if (name.between != first.between) return {};
  }
  for (std::size_t i = 0; i < first.numbers.size(); ++i) {
    const bool differs = std::any_of(names.begin(), names.end(), [&](const NumbersInName& name) {
      return name.numbers[i] != first.numbers[i];
    });
    if (differs) differing.push_back(i);
  }
  return differing;
}

/// The camera's images by those numbers; none where there are none.
CameraImages by_numbers(const CameraImages& images) {
  std::vector<NumbersInName> names;
  for (const auto& [key, path] : images.of_frames) names.emplace_back(key);
  const std::vector<std::size_t> differing = differing_numbers(names);
  CameraImages renamed{.folder = images.folder, .of_frames = {}, .listed = images.listed};
  if (differing.empty()) return renamed;
  // Cameras may write 7 and 07; where one writes both, they are two.
  for (const bool with_zeros : {false, true}) {
    renamed.of_frames.clear();
    std::size_t number = 0;
    for (const auto& image : images.of_frames) {
      std::string key;
      for (const std::size_t i : differing) {
        const std::string& digits = names[number].numbers[i];
        key += (key.empty() ? "" : "_");
        key += with_zeros ? std::string_view(digits) : significant(digits);
      }
      renamed.of_frames.emplace(key, image.second);
      ++number;
    }
    if (renamed.of_frames.size() == images.of_frames.size()) break;
  }
  return renamed;
}

/// Of one camera, in the order of time.
std::vector<std::pair<std::int64_t, std::string>> times_of(const CameraImages& images) {
  std::vector<std::string> names;
  for (const auto& [key, path] : images.of_frames) names.push_back(key);
  const bool of_any_clock = !images.listed && end_in_seconds(names);
  std::vector<std::pair<std::int64_t, std::string>> times;
  for (const std::string& key : names) {
    const auto time = images.listed ? whole_number(key) : time_in_name(key, of_any_clock);
    if (time) times.emplace_back(*time, key);
  }
  std::sort(times.begin(), times.end());
  return times;
}

double seconds_apart(std::int64_t a, std::int64_t b) {
  return std::abs(static_cast<double>(a - b)) * seconds_per_nanosecond;
}

/// Of times in order, at least one.
template <class Times>
const auto& nearest(const Times& times, std::int64_t time) {
  auto found = std::lower_bound(times.begin(), times.end(), std::pair(time, std::string()));
  if (found == times.end() || (found != times.begin() && seconds_apart((found - 1)->first, time) <
                                                             seconds_apart(found->first, time))) {
    --found;
  }
  return *found;
}

}  // namespace

bool NumericalOrder::operator()(const std::string& a, const std::string& b) const {
  std::string_view x = a;
  std::string_view y = b;
  while (!x.empty() && !y.empty()) {
    const std::string_view part_of_x = first_part(x);
    const std::string_view part_of_y = first_part(y);
    const bool are_numbers = is_digit(x.front()) && is_digit(y.front());
    const int order =
        are_numbers ? compare_numbers(part_of_x, part_of_y) : part_of_x.compare(part_of_y);
    if (order != 0) return order < 0;
    x.remove_prefix(part_of_x.size());
    y.remove_prefix(part_of_y.size());
  }
  if (x.empty() != y.empty()) return x.empty();
  return a < b;  // 7 and 007 are two names
}

std::optional<std::int64_t> whole_number(const std::string& digits) {
  std::int64_t value = 0;
  const auto result = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  const bool all_digits = !digits.empty() && std::all_of(digits.begin(), digits.end(), is_digit);
  if (!all_digits || result.ec != std::errc()) return std::nullopt;
  return value;
}

void match_by_numbers(std::vector<CameraImages>& cameras) {
  std::vector<CameraImages> renamed;
  for (const CameraImages& images : cameras) {
    if (images.listed) return;
    renamed.push_back(by_numbers(images));
    if (renamed.back().of_frames.empty()) return;
  }
  cameras = std::move(renamed);
}

void match_by_times(std::vector<CameraImages>& cameras, double tolerance) {
  const auto of_first = times_of(cameras.front());
  if (of_first.empty()) return;
  for (std::size_t i = 1; i < cameras.size(); ++i) {
    const auto times = times_of(cameras[i]);
    for (const auto& [time, key] : times) {
      const auto& [time_of_first, key_of_first] = nearest(of_first, time);
      const bool is_nearest_of_both = nearest(times, time_of_first).first == time;
      if (key == key_of_first || !is_nearest_of_both ||
          seconds_apart(time, time_of_first) > tolerance) {
        continue;
      }
      auto image = cameras[i].of_frames.extract(key);
      image.key() = key_of_first;
      cameras[i].of_frames.insert(std::move(image));
    }
  }
}

std::optional<double> least_time_apart(const std::vector<CameraImages>& cameras) {
  const auto of_first = times_of(cameras.front());
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < cameras.size() && !of_first.empty(); ++i) {
    for (const auto& [time, key] : times_of(cameras[i])) {
      least = std::min(least, seconds_apart(nearest(of_first, time).first, time));
    }
  }
  if (!std::isfinite(least)) return std::nullopt;
  return least;
}

}  // namespace widestereo
