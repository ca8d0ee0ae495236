// SPDX-License-Identifier: MIT
#pragma once

#include <stdexcept>

namespace widestereo {

/// The only kind of exception the library throws on purpose. The message is one sentence (or two)
/// that names the file or value at fault and the remedy; it is fit to be shown to a user as it is.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// No view of a match sees what another one does within the range of distances.
class NoOverlap : public Error {
 public:
  using Error::Error;
};

}  // namespace widestereo
