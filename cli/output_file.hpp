// Results that go to a file, or to standard output.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "rules/model/model_texts.hpp"

namespace arbiter::cli {

// Throws rules::FileError where `output` is one of the files that were read, under whatever name.
void require_no_input(const std::string& output, const rules::ModelTexts& inputs);

// The same for any input; `option` is what the user named the output with.
void require_no_input(const std::string& option, const std::string& output,
                      const std::string& input);
// Throws rules::FileError where the outputs of two options would be one file.
void require_two_files(const std::string& option, const std::string& output,
                       const std::string& other_option, const std::string& other);

// Throws CLI::ValidationError, which says why, where `output` is given and is standard output.
void require_named_file(const std::string& output, const std::string& why);

// --force, for verbs whose files somebody may have changed by hand or may have no second time.
void add_force_option(CLI::App& verb, bool& replaces);

// Whether that file is there, and has this content. Standard output has none.
[[nodiscard]] bool holds_already(const std::string& path, const std::string& content);

// Throws rules::FileError where a file is there already, unless it may be replaced (--force).
void require_new_file(const std::string& output, bool replaces);

// To standard output where `path` is empty, "-" or "/dev/stdout".
// Whoever reads a file sees the old content or the new one, never a part. What is no regular file
// is written as it is. Throws rules::FileError.
void write_output(const std::string& path, const std::string& content);

inline constexpr const char* kOutputHelp = "File to write; without it, or with -, standard output";

}  // namespace arbiter::cli
