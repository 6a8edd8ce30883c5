// Whether a source of another host is imported here now: opened under its name, as a component
// would.
//
// A port is held exactly as long as this says kImport. So a source whose speaker is gone has no
// component that has it open: with a finite T its activity ends by silence; for `forever` its input
// ports become idle, and what it inhibits stays inhibited (docs/semantics.md).
#pragma once

#include <cstdint>

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

}  // namespace arbiter::link
