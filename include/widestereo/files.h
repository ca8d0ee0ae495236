// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string>

namespace widestereo {

/// Writes a file: `write` fills a stream whose every byte is checked. What lies at `path` is
/// replaced at once when all is written and left as it was when anything fails; symbolic links stay
/// and the file that they lead to is replaced. Devices, FIFOs and /dev/stdout are written directly.
/// Throws Error naming `path`, the cause and the remedy.
void write_file(const std::filesystem::path& path,
                const std::function<void(std::ostream& stream)>& write);

/// Writes text. Throws Error as write_file() does.
void write_text(const std::filesystem::path& path, const std::string& text);

/// Creates the folder (and parents) if needed and checks that files can be made in it. Throws Error
/// naming the folder where either fails.
void prepare_output_folder(const std::filesystem::path& folder);

/// Removes from a folder, in which no other process may be writing, what write_file() leaves there
/// where its process is killed.
void remove_unfinished_files(const std::filesystem::path& folder);

/// Throws Error where a file cannot be written, for those that are written after long work.
void require_writable(const std::filesystem::path& file);

}  // namespace widestereo
