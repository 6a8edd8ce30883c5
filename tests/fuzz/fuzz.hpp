// What the fuzz targets have in common. Each file fuzz_*.cpp defines LLVMFuzzerTestOneInput, which
// libFuzzer calls with inputs that it makes up, and corpus_test.cpp with those of the corpus.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>
#include <string_view>

#include "rules/ask/report.hpp"
#include "rules/text/diagnostic.hpp"
#include "rules/text/text_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace arbiter::fuzz {

inline std::string text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

// What must hold for every input.
inline void require(bool holds, std::string_view what) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %.*s\n", static_cast<int>(what.size()), what.data());
  std::abort();
}

// Whatever is found has a place, a code and a message that can be read, and can be reported.
inline void check_findings(const rules::Diagnostics& diagnostics) {
  constexpr std::size_t kLongestMessage = 4'000;
  bool has_errors = false;
  for (const rules::Diagnostic& item : diagnostics.items()) {
    has_errors = has_errors || item.severity == rules::Severity::kError;
    require(item.where.line >= 1 && item.where.column >= 1, "a finding has a place");
    require(!item.code.empty() && !item.message.empty(), "a finding has a code and a message");
    require(item.message.size() <= kLongestMessage, "a message can be read");
    require(item.message.find('\n') == std::string::npos, "a message is one line");
  }
  require(!has_errors || diagnostics.has_errors(), "an error counts");
  std::ostringstream report;
  rules::write_text(report, diagnostics);
  rules::write_json(report, diagnostics);
}

}  // namespace arbiter::fuzz
