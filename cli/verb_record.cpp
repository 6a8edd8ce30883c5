// arbiter record: writes down what happens in a running instance.
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <fstream>
#include <functional>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/flight_recorder.hpp"
#include "cli/live.hpp"
#include "cli/numbers.hpp"
#include "cli/output_file.hpp"
#include "cli/port_patterns.hpp"
#include "cli/recording_info.hpp"
#include "cli/verbs.hpp"
#include "command_line/shell_word.hpp"
#include "logging/log_writer.hpp"
#include "recorder/recorder.hpp"
#include "recording/compression.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"
#include "watch/machine.hpp"

namespace arbiter::cli {
namespace {

struct RecordOptions {
  std::string out;
  std::vector<std::string> ports;
  bool all = false;
  std::string payloads = "none";
  std::string compression = "zstd";
  shm::Nanoseconds duration = shm::kForever;
  shm::Nanoseconds period = 1'000'000;
  FlightOptions flight;
  bool is_dump = false;
  shm::Nanoseconds patience = 30'000'000'000;  // of --dump
  std::string instance;
};

// As MCAP files name it.
recording::Compression compression_of(const std::string& name) {
  return recording::compression_of(name == "none" ? "" : name);
}

// What was typed, as far as a shell hands it on.
std::string typed_command() {
  std::ifstream words("/proc/self/cmdline", std::ios::binary);
  std::string text;
  for (std::string word; std::getline(words, word, '\0');) {
    text += (text.empty() ? "" : " ") + command_line::shell_word(word);
  }
  return text;
}

void warn_of_patterns_without_port(const RecordOptions& options) {
  const bool has_pattern = options.payloads != "all" && options.payloads != "none";
  if (options.ports.empty() && !has_pattern) return;
  try {
    const wire::Status status = fetch_status("record", options.instance);
    PatternCheck("--port", status).inputs(options.ports);
    if (has_pattern) PatternCheck("--payloads", status).outputs({options.payloads});
  } catch (const wire::CallError&) {
    // What is wrong, recording will say.
  }
}

// Whoever does not read standard error must not hold up the recording.
std::function<void(const std::string&)> standard_error() {
  const std::shared_ptr<logging::LogWriter> writer(
      new logging::LogWriter(logging::LogWriter::to_standard_error("arbiter: ")));
  return [writer](const std::string& text) { writer->put("arbiter: " + text + '\n'); };
}

recorder::RecorderOptions recorder_options(const RecordOptions& options) {
  recorder::RecorderOptions result;
  result.caller = caller("record", options.instance);
  result.caller.answer_time = std::chrono::milliseconds(1000);
  result.node = live_options(options.instance);
  result.ports = options.ports;
  result.payloads = options.payloads;
  result.period = options.period;
  result.say = standard_error();
  result.node.on_notice = [say = result.say](const Notice& notice) { say(notice.text); };
  return result;
}

void write_summary(const recorder::Recorded& recorded, const std::string& file,
                   std::uint64_t bytes) {
  std::ostringstream out;
  constexpr std::size_t kMost = recorder::CountedSources::kMost;
  out << rules::counted(recorded.arrivals, "arrival") << " of "
      << (recorded.sources > kMost ? "more than " : "")
      << rules::counted(std::min(recorded.sources, kMost), "source") << " and "
      << rules::counted(recorded.winner_changes, "change") << " of winner in "
      << seconds_text(recorded.time) << ": " << file << ", " << size_text(bytes) << '\n';
  if (recorded.lost_events != 0 || recorded.lost_samples != 0) {
    out << "missed " << rules::counted(recorded.lost_events, "event") << ", and the payloads of "
        << rules::counted(recorded.lost_samples, "sample") << "; the file says where\n";
  }
  std::cout << out.str();
}

evidence::RecordingInfo info_of(const recorder::RecorderOptions& settings) {
  evidence::RecordingInfo info;
  info.program = "arbiter " ARBITER_VERSION;
  info.instance = settings.caller.instance;
  info.host = watch::host_name();
  info.command = typed_command();
  info.wall_offset = evidence::wall_offset_now();
  info.say = settings.say;
  return info;
}

int record_into_file(const RecordOptions& options, const recorder::RecorderOptions& settings) {
  const auto interrupts = catch_interrupts();
  recorder::FileSink sink(options.out, {compression_of(options.compression)}, info_of(settings));
  try {
    recorder::Recorder recorder(settings, sink);
    settings.say("recording " + rules::counted(recorder.taps(), "source") + " into " + options.out);
    recorder.run(time_after(shm::monotonic_now(), options.duration), interrupts.get(),
                 [] { return false; });
    const auto recorded = recorder.finish();
    write_summary(recorded, options.out, sink.writer().bytes());
  } catch (const recording::McapError&) {
    throw;  // what was written stays
  } catch (...) {
    if (sink.writer().count_of(evidence::RecordKind::kStart) == 0) ::unlink(options.out.c_str());
    throw;
  }
  return 0;
}

int record(RecordOptions& options) {
  require_named_file(options.out, kMustBeFile);
  if (options.is_dump) return dump(options.out, options.patience);
  std::signal(SIGXFSZ, SIG_IGN);  // a file that has become too large is an error as any other
  const auto settings = recorder_options(options);
  warn_of_patterns_without_port(options);
  if (options.flight.span == 0) return record_into_file(options, settings);
  options.flight.prefix = options.out;
  options.flight.duration = options.duration;
  return fly(options.flight, settings, {compression_of(options.compression)}, info_of(settings));
}

// 64MiB, 500KiB, 1GiB.
std::size_t read_size(const std::string& text) {
  std::size_t used = 0;
  std::uint64_t number = 0;
  try {
    number = std::stoull(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  const std::string unit = text.substr(std::min(used, text.size()));
  const int shift = unit == "KiB" ? 10 : unit == "MiB" ? 20 : unit == "GiB" ? 30 : -1;
  if (used == 0 || text.front() == '-' || shift < 0 || number == 0 || number > 4096) {
    throw CLI::ValidationError("--memory", '"' + text +
                                               "\" is not a size such as 64MiB: write 1 to 4096, "
                                               "and KiB, MiB or GiB");
  }
  return static_cast<std::size_t>(number) << shift;
}

void add_flight_options(CLI::App& verb, const std::shared_ptr<RecordOptions>& options) {
  auto* ring =
      verb.add_option_function<std::string>(
              "--ring",
              [options](const std::string& text) {
                options->flight.span = read_time("--ring", text);
                if (options->flight.span < 1) {
                  throw CLI::ValidationError("--ring", "must be more than 0s");
                }
              },
              "Flight recorder: keep the records of this time in memory, up to --memory, and "
              "write them to FILE-TIME-WHY.mcap at SIGUSR1, at --dump, when --when becomes true, "
              "and when a component dies")
          ->type_name("DURATION");
  verb.add_option_function<std::string>(
          "--memory",
          [options](const std::string& text) { options->flight.memory = read_size(text); },
          "How much memory --ring may use (default 64MiB): beyond it the oldest records give way, "
          "even if they are younger than --ring's time; before them, payloads beyond half of it")
      ->type_name("SIZE")
      ->needs(ring);
  verb.add_option_function<std::string>(
          "--when", [options](const std::string& text) { options->flight.when = text; },
          "With --ring: write when this becomes true, a statement as `arbiter wait --until` "
          "reads it")
      ->type_name("STATEMENT")
      ->needs(ring);
  verb.add_option_function<std::string>(
          "--after",
          [options](const std::string& text) {
            options->flight.after = read_time("--after", text);
          },
          "With --ring: how long a file of --when or of a death goes on after its reason (default "
          "2s), so that it shows what came of it; at most half of --ring's time")
      ->type_name("DURATION")
      ->needs(ring);
  verb.add_option("--keep", options->flight.keep,
                  "With --ring: how many files of --when and of deaths are kept (default 16); for "
                  "a newer one, the recorder removes its oldest. Files that you ask for stay")
      ->type_name("N")
      ->check(at_least_one())
      ->needs(ring);
  auto* asks = verb.add_flag("--dump", options->is_dump,
                             "Ask the flight recorder that was started with this -o to write, and "
                             "wait for it")
                   ->excludes(ring);
  verb.add_option_function<std::string>(
          "--timeout",
          [options](const std::string& text) { options->patience = read_time("--timeout", text); },
          "With --dump: give up after this time (default 30s)")
      ->type_name("DURATION")
      ->needs(asks);
}

}  // namespace

void add_record(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<RecordOptions>();
  CLI::App* verb =
      app.add_subcommand("record", "Write down what happens: arrivals, decisions, winners");
  verb->add_option(
          "-o,--output", options->out,
          "The recording, a new file: .mcap; with --ring, what the files' names begin with")
      ->type_name("FILE")
      ->required();
  auto* all = verb->add_flag("--all", options->all, "All sources that there are; the default");
  verb->add_option("--port", options->ports,
                   "Input ports whose sources are recorded: those they are connected to, and those "
                   "their rules read; a pattern such as '/Arm/*'; repeatable")
      ->type_name("PATTERN")
      ->excludes(all);
  verb->add_option("--payloads", options->payloads,
                   "Whose samples are kept: all, none (default), or a pattern of output ports")
      ->type_name("all|none|PATTERN");
  verb->add_option("--compression", options->compression, "zstd (default), lz4 or none")
      ->check(one_of({"zstd", "lz4", "none"}));
  verb->add_option_function<std::string>(
          "--duration",
          [options](const std::string& text) { options->duration = read_time("--duration", text); },
          "End after this time, such as 30s; by default, when interrupted")
      ->type_name("DURATION");
  verb->add_option_function<std::string>(
          "--period",
          [options](const std::string& text) {
            options->period = read_time_within("--period", text, 100'000, 1'000'000'000);
          },
          "How often taps are read, 100us to 1s (default 1ms): what happened closer together than "
          "this may be of unknown order")
      ->type_name("DURATION");
  add_flight_options(*verb, options);
  add_instance_option(*verb, options->instance);
  verb->footer(
      "Example:\n"
      "  arbiter record -o incident.mcap\n"
      "  arbiter record -o arm.mcap --port '/Arm/*' --payloads all --duration 30s\n"
      "  arbiter record --ring 5min -o /var/lib/robot/flight "
      "--when 'winner(/Arm/pos:i) = /Teleop/pos:o and not /Deadman:o'\n"
      "  arbiter record --dump -o /var/lib/robot/flight\n\n"
      "Ends at Ctrl-C, SIGTERM or SIGHUP (the terminal has gone; `nohup` keeps it running), with a "
      "whole\nfile. To record, you need the policy's `tap`.");
  verb->callback([options, &exit_code] { exit_code = record(*options); });
}

}  // namespace arbiter::cli
