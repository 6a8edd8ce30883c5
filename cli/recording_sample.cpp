#include "cli/recording_sample.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/numbers.hpp"
#include "cli/output_file.hpp"
#include "cli/progress.hpp"
#include "cli/recording_times.hpp"
#include "evidence/record_reader.hpp"
#include "rules/text/names.hpp"
#include "rules/text/text_file.hpp"
#include "shm/utf8.hpp"

namespace arbiter::cli {
namespace {

using evidence::Arrival;

struct SampleOptions {
  std::string file;
  std::string source;
  std::optional<std::uint64_t> sequence;
  std::string at;
  std::string output;
  bool replaces = false;
};

// A sample of the source, in the file's order.
struct Candidate {
  std::uint64_t sequence = 0;
  shm::Nanoseconds time = 0;
  bool has_payload = false;
};

// All that the file has of the source, but for what is in the samples.
struct Found {
  evidence::ReadRecording about;
  std::set<std::string> sources;
  std::vector<Candidate> samples;
  shm::Nanoseconds begin = std::numeric_limits<shm::Nanoseconds>::max();  // of the recording
  shm::Nanoseconds end = std::numeric_limits<shm::Nanoseconds>::min();
};

[[noreturn]] void refuse_sample(const SampleOptions& options, const std::string& why) {
  throw rules::FileError(options.file + ": " + why);
}

std::string source_of(const SampleOptions& options) { return shm::printable(options.source); }

Found look_for(const SampleOptions& options) {
  Found found;
  const auto use = [&](evidence::Record&& record) {
    if (const auto* const start = std::get_if<evidence::Start>(&record)) {
      found.begin = std::min(found.begin, start->time);
    }
    const auto* const arrival = std::get_if<Arrival>(&record);
    if (arrival == nullptr) return;
    found.begin = std::min(found.begin, arrival->time);
    found.end = std::max(found.end, arrival->time);
    found.sources.insert(arrival->context->source);
    if (arrival->is_sample && arrival->context->source == options.source) {
      found.samples.push_back({arrival->sequence, arrival->time, arrival->has_payload});
    }
  };
  ProgressLine line;
  found.about = evidence::read_recording(options.file, evidence::Payloads::pass_over, use,
                                         line.watch("looking for the sample"));
  found.end = std::max(found.end, found.about.recorded_until);
  return found;
}

void require_samples(const SampleOptions& options, const Found& found) {
  if (found.sources.count(options.source) == 0) {
    const std::vector<std::string_view> names(found.sources.begin(), found.sources.end());
    const auto similar = rules::find_similar(options.source, names);
    refuse_sample(options, "nothing of " + source_of(options) + " arrived" +
                               (similar ? "; did you mean " + shm::printable(*similar) + '?' : ""));
  }
  if (found.samples.empty())
    refuse_sample(options, source_of(options) + " only signalled: it has no samples");
  if (std::none_of(found.samples.begin(), found.samples.end(),
                   [](const Candidate& each) { return each.has_payload; })) {
    refuse_sample(options, "what was in the samples of " + source_of(options) +
                               " is not recorded; record it with --payloads all");
  }
}

std::string clock_of(const Found& found, const Candidate& sample) {
  return clock_text(sample.time + found.about.wall_offset);
}

std::size_t with_sequence(const SampleOptions& options, const Found& found) {
  const auto is_it = [&](const Candidate& each) { return each.sequence == *options.sequence; };
  const auto first = std::find_if(found.samples.begin(), found.samples.end(), is_it);
  if (first == found.samples.end()) {
    refuse_sample(options, source_of(options) + " has no sample " +
                               std::to_string(*options.sequence) + " here: the first is " +
                               std::to_string(found.samples.front().sequence) + ", the last " +
                               std::to_string(found.samples.back().sequence));
  }
  const auto again = std::find_if(std::next(first), found.samples.end(), is_it);
  if (again != found.samples.end()) {
    refuse_sample(options, source_of(options) + " was opened again, and has several samples " +
                               std::to_string(*options.sequence) + ", at " +
                               clock_of(found, *first) + " and at " + clock_of(found, *again) +
                               "; choose one by --at");
  }
  return static_cast<std::size_t>(first - found.samples.begin());
}

// The last that had come by then.
std::size_t at_moment(const SampleOptions& options, const Found& found) {
  const auto span = read_moment(options.at, {found.begin, found.end, found.about.wall_offset});
  for (std::size_t i = found.samples.size(); i-- != 0;) {
    if (found.samples[i].time < span.to) return i;
  }
  refuse_sample(options, "by then no sample of " + source_of(options) +
                             " had come: the first came at " +
                             clock_of(found, found.samples.front()));
}

std::size_t choose(const SampleOptions& options, const Found& found) {
  if (options.sequence) return with_sequence(options, found);
  if (!options.at.empty()) return at_moment(options, found);
  std::size_t last = found.samples.size() - 1;
  while (!found.samples[last].has_payload) --last;
  return last;
}

// Of the sample of that number, from 0.
Arrival read_sample(const SampleOptions& options, std::size_t number) {
  std::optional<Arrival> result;
  const auto use = [&](evidence::Record&& record) {
    auto* const arrival = std::get_if<Arrival>(&record);
    if (arrival == nullptr || !arrival->is_sample || arrival->context->source != options.source) {
      return;
    }
    if (number-- == 0) result = std::move(*arrival);
  };
  ProgressLine line;
  evidence::read_recording(options.file, evidence::Payloads::read, use,
                           line.watch("reading the sample"));
  line.clear();
  if (!result || !result->payload) refuse_sample(options, "it has changed while it was read");
  return std::move(*result);
}

int write_sample(const SampleOptions& options) {
  if (options.output.empty() && ::isatty(STDOUT_FILENO) != 0) {
    throw CLI::ValidationError("sample",
                               "a terminal cannot show bytes: write them to a file "
                               "(-o FILE), or to a program (| xxd)");
  }
  require_no_input("--output", options.output, options.file);
  require_new_file(options.output, options.replaces);
  const Found found = look_for(options);
  require_samples(options, found);
  const std::size_t number = choose(options, found);
  const Candidate& chosen = found.samples[number];
  const std::string what = "sample " + std::to_string(chosen.sequence) + " of " +
                           source_of(options) + ", which came at " + clock_of(found, chosen);
  if (!chosen.has_payload) refuse_sample(options, "what was in " + what + ", is not recorded");
  const Arrival sample = read_sample(options, number);
  const std::string bytes(reinterpret_cast<const char*>(sample.payload->data()),
                          sample.payload->size());
  write_output(options.output, bytes);
  const std::string& type = sample.context->type;
  std::cerr << what << ": " << bytes.size() << (bytes.size() == 1 ? " byte" : " bytes") << ", "
            << (type.empty() ? "untyped" : shm::printable(type)) << '\n';
  return 0;
}

}  // namespace

void add_recorded_sample(CLI::App& parent, int& exit_code) {
  const auto options = std::make_shared<SampleOptions>();
  CLI::App* verb = parent.add_subcommand("sample", "Write what was in one recorded sample");
  verb->add_option("FILE", options->file, "A recording with payloads")->required();
  verb->add_option("--source", options->source, "The output port that published it")
      ->required()
      ->type_name("PORT");
  auto* const sequence =
      verb->add_option("--sequence", options->sequence,
                       "Its number, as `arbiter echo` and the recording count; without "
                       "this and --at, the last that was recorded");
  sequence->type_name("N")->check(at_least(0));
  verb->add_option("--at", options->at,
                   "The last that had come by this time of day, in your time zone (TZ): 14:03:07 "
                   "(by the end of that second), 14:03:07.250, '2026-11-22 14:03:07'")
      ->excludes(sequence)
      ->type_name("TIME");
  verb->add_option("-o,--output", options->output, kOutputHelp)->type_name("FILE");
  add_force_option(*verb, options->replaces);
  verb->footer(
      "Example:\n  arbiter recording sample incident.mcap --source /Nav/cmd_vel:o --at 14:03:07 | "
      "xxd\n\n"
      "The bytes are written as they were published, and nothing else; standard error says which "
      "sample\nit is, and its type.\n\n"
      "Exit codes: 0 written; 1 a file that `arbiter record` has not made; 2 wrong use, a file "
      "that cannot\nbe read or written or is there already, or a sample that is not in it");
  verb->callback([options, &exit_code] { exit_code = write_sample(*options); });
}

}  // namespace arbiter::cli
