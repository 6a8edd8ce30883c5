// Whether a source of another host is imported here now: opened under its name, as a component
// would.
//
// A port is held exactly as long as this says kImport. So a source whose speaker is gone has no
// component that has it open: with a finite T its activity ends by silence; for `forever` its input
// ports become idle, and what it inhibits stays inhibited (docs/semantics.md).
#pragma once

#include <cstdint>
#include <string_view>

namespace arbiter::link {

enum class ImportChoice : std::uint8_t {
  kNotWanted,   // the model in force neither connects nor reads it
  kSpokenHere,  // a component of this host has it open
  kNoSpeaker,   // no other host offers it
  kImport,
};

struct ImportFacts {
  bool is_wanted = false;
  bool is_open_here = false;  // by another component than this link
  bool has_speaker = false;
};

[[nodiscard]] constexpr ImportChoice choose_import(const ImportFacts& facts) noexcept {
  if (!facts.is_wanted) return ImportChoice::kNotWanted;
  if (facts.is_open_here) return ImportChoice::kSpokenHere;
  return facts.has_speaker ? ImportChoice::kImport : ImportChoice::kNoSpeaker;
}

// For people.
[[nodiscard]] constexpr std::string_view words_of(ImportChoice choice) noexcept {
  switch (choice) {
    case ImportChoice::kNotWanted:
      return "the model does not mention it";
    case ImportChoice::kSpokenHere:
      return "a component of this host has it open";
    case ImportChoice::kNoSpeaker:
      return "no other host offers it";
    case ImportChoice::kImport:
      return "imported";
  }
  return "";
}

}  // namespace arbiter::link
