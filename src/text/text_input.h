// SPDX-License-Identifier: MIT
// Text files that are read to their end or not at all.
#pragma once

#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <utility>

#include "widestereo/error.h"

namespace widestereo {

/// A text file, past the byte order mark that some editors begin it with.
class TextInput {
 public:
  /// Throws Error where it cannot be opened, or is a device, which may have no end.
  explicit TextInput(std::filesystem::path path) : path_(std::move(path)) {
    std::error_code ignored;  // what cannot be opened is refused next
    if (std::filesystem::is_character_file(path_, ignored)) {
      throw Error(path_.string() + " is a device; give a file or a pipe.");
    }
    errno = 0;
    stream_.open(path_, std::ios::binary);
    if (!stream_) fail();
    refuse_utf16();
    skip_byte_order_mark();
  }

  /// Takes the next line without its end; false after the last one. Throws Error where the file
  /// cannot be read on: its end would be taken for that of the text.
  bool next_line(std::string& line) {
    errno = 0;
    const bool found = static_cast<bool>(std::getline(stream_, line));
    require_read();
    return found;
  }

  /// All that is left. Throws Error likewise.
  std::string rest() {
    std::string text;
    std::array<char, 1 << 16> part{};
    errno = 0;
    while (stream_) {
      stream_.read(part.data(), part.size());
      text.append(part.data(), static_cast<std::size_t>(stream_.gcount()));
    }
    require_read();
    return text;
  }

 private:
  /// Begins with a mark that no other text begins with.
  void refuse_utf16() {
    const int first = stream_.peek();
    if (first == 0xff || first == 0xfe) {
      stream_.get();
      if (stream_.peek() == (first ^ 1)) {
        throw Error(path_.string() + " is text in UTF-16; save it as UTF-8.");
      }
      stream_.unget();
    }
    require_read();
    stream_.clear();
  }

  void skip_byte_order_mark() {
    bool at_start = true;
    for (const int byte : {0xef, 0xbb, 0xbf}) {
      if (stream_.peek() != byte) {
        require_read();
        stream_.clear();
        if (!at_start) stream_.seekg(0);  // pipes cannot
        return;
      }
      stream_.get();
      at_start = false;
    }
  }

  void require_read() const {
    if (stream_.bad()) fail();
  }

  [[noreturn]] void fail() const {
    const std::string cause = errno == 0 ? "" : ": " + std::generic_category().message(errno);
    throw Error("Cannot read " + path_.string() + cause + "; check the path and permissions.");
  }

  std::filesystem::path path_;
  std::ifstream stream_;
};

}  // namespace widestereo
