// SPDX-License-Identifier: MIT
#pragma once

#include <clocale>
#include <locale>
#include <string>

namespace widestereo::test {

/// Streams made in its scope write 1234.5 as 1.234,5 unless they say otherwise.
class CommaStreams {
 public:
  CommaStreams() : before_(std::locale::global({std::locale::classic(), new Punctuation})) {}
  ~CommaStreams() { std::locale::global(before_); }
  CommaStreams(const CommaStreams&) = delete;
  CommaStreams& operator=(const CommaStreams&) = delete;

 private:
  struct Punctuation : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };
  std::locale before_;
};

/// In its scope C's functions take a comma for the decimal point, if a locale that does is
/// installed.
class CommaNumbers {
 public:
  CommaNumbers() : before_(std::setlocale(LC_NUMERIC, nullptr)) {
    for (const char* name : {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "fr_FR.utf8", "de_DE"}) {
      if (std::setlocale(LC_NUMERIC, name) != nullptr) {
        installed_ = true;
        return;
      }
    }
  }
  ~CommaNumbers() { std::setlocale(LC_NUMERIC, before_.c_str()); }
  CommaNumbers(const CommaNumbers&) = delete;
  CommaNumbers& operator=(const CommaNumbers&) = delete;

  bool installed() const { return installed_; }

 private:
  std::string before_;
  bool installed_ = false;
};

}  // namespace widestereo::test
