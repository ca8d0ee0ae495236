// SPDX-License-Identifier: MIT
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace widestereo {

/// The only kind of exception the library throws on purpose. The message is one sentence (or two)
/// that names the file or value at fault and the remedy; it is fit to be shown to a user as it is.
class Error : public std::runtime_error {
 public:
  /// Control characters, as damaged files have them, become spaces: a zero would end the message.
  explicit Error(std::string message) : std::runtime_error(printable(std::move(message))) {}

 private:
  static std::string printable(std::string text) {
    for (char& letter : text) {
      if (static_cast<unsigned char>(letter) < ' ' || letter == '\x7f') letter = ' ';
    }
    return text;
  }
};

/// No view of a match sees what another one does within the range of distances.
class NoOverlap : public Error {
 public:
  using Error::Error;
};

}  // namespace widestereo
