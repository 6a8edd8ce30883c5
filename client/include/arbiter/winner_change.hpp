// The samples that `arbiter winners` publishes: who commands an input port, and who did before.
//
//   auto in = node.input_port<arbiter::WinnerChange>("/Lights/winner:i");
//   if (auto news = in.take()) show((*news)->port, (*news)->winner);
//
// The source's name is "/arbiter/winner", the watched input port's name, and ":o":
// /arbiter/winner/Base/cmd:i:o. A model connects it, as any source: <config
// at="/Lights/winner:i">/arbiter/winner/Base/cmd:i:o</config>.
//
// Units: times in nanoseconds of CLOCK_MONOTONIC. Threads: a value. The layout is part of the
// interface: what changes it gets another type name. The paper has nothing of it.
#pragma once

#include <cstdint>
#include <string_view>

#include <arbiter/type.hpp>

namespace arbiter {

enum class WinnerNews : std::uint32_t {
  start = 1,  // the first sample: `before` is empty
  change,     // another winner than in the sample before
  unchanged,  // sent now and then, for those who have come since
};

struct WinnerChange {
  std::int64_t time_ns;      // since when, as far as activities show
  std::int64_t seen_ns;      // when it was noticed, or of `unchanged`: looked at
  std::uint64_t generation;  // of the model in force then
  std::uint64_t changes;     // counts the samples of kind `change`: one that is missing was lost
  WinnerNews news;
  std::uint32_t is_arbitrated;  // 0: no rule of the model mentions the port
  char port[256];               // the input port's name: UTF-8, ends with a zero byte
  char winner[256];             // the source that the rules select; empty: none
  char before[256];             // the one before
};

static_assert(sizeof(WinnerChange) == 808 && alignof(WinnerChange) == 8,
              "programs of other languages read it too");

}  // namespace arbiter

ARBITER_TYPE(arbiter::WinnerChange, "arbiter/WinnerChange");
