// arbiter echo: opens an input port and prints what its arbiter lets through.
#include <poll.h>

#include <cstdint>
#include <exception>
#include <iostream>
#include <map>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/live.hpp"
#include "cli/numbers.hpp"
#include "cli/verbs.hpp"
#include "rules/text/duration.hpp"
#include "shm/clock.hpp"

namespace arbiter::cli {
namespace {

constexpr std::uint32_t kDepth = 1024;
constexpr std::size_t kPreviewBytes = 16;

struct EchoOptions {
  std::string port;
  std::string instance;
  std::uint64_t count = 0;  // 0: no limit
  shm::Nanoseconds duration = shm::kForever;
  bool json = false;
};

std::string preview(const Bytes& bytes) {
  static constexpr char kHex[] = "0123456789abcdef";
  std::string text;
  for (std::size_t i = 0; i < bytes.size() && i < kPreviewBytes; ++i) {
    const auto value = std::to_integer<unsigned>(bytes[i]);
    if (i != 0) text += ' ';
    text += kHex[value >> 4];
    text += kHex[value & 15];
  }
  return bytes.size() > kPreviewBytes ? text + " …" : text;
}

class Echo {
 public:
  Echo(const EchoOptions& options, shm::FileDescriptor interrupts)
      : options_(options),
        interrupts_(std::move(interrupts)),
        node_("arbiter-echo", live_options(options.instance)),
        in_(open(node_, options.port)),
        started_(shm::monotonic_now()) {}

  int run() {
    const shm::Nanoseconds end =
        options_.duration == shm::kForever ? shm::kForever : started_ + options_.duration;
    pollfd ready[] = {{in_.fd(), POLLIN, 0}, {interrupts_.get(), POLLIN, 0}};
    for (;;) {
      while (auto sample = in_.take()) {
        print(*sample);
        if (++samples_ == options_.count || !std::cout) return finish();
      }
      std::cout.flush();
      const shm::Nanoseconds left = end - shm::monotonic_now();
      if (left <= 0) return finish();
      const timespec span{left / 1'000'000'000, left % 1'000'000'000};
      ppoll(ready, 2, end == shm::kForever ? nullptr : &span, nullptr);
      if (ready[1].revents != 0) return finish();
    }
  }

 private:
  static InputPort<void> open(Node& node, const std::string& port) {
    InputPortOptions options;
    options.keep = true;
    options.depth = kDepth;
    return node.input_port(port, options);
  }

  void print(const Sample<void>& sample) {
    ++by_source_[sample.source()];
    if (options_.json) {
      std::cout << nlohmann::json{{"port", options_.port},
                                  {"source", sample.source()},
                                  {"sequence", sample.sequence()},
                                  {"stamp_ns", sample.stamp_ns()},
                                  {"size", sample.size()}}
                       .dump()
                << '\n';
      return;
    }
    std::cout << seconds_text(sample.stamp_ns() - started_) << "  " << sample.source() << "  #"
              << sample.sequence() << "  " << sample.size() << " bytes  " << preview(*sample)
              << '\n';
  }

  // On standard error beside JSON, which is for programs.
  int finish() {
    std::ostream& out = options_.json ? std::cerr : std::cout;
    out << samples_ << " samples in " << seconds_text(shm::monotonic_now() - started_);
    for (const auto& [source, count] : by_source_) out << ", " << count << " from " << source;
    out << '\n';
    if (const auto lost = overtaken(); lost != 0) {
      std::cerr << "arbiter: " << lost << " more came faster than they could be printed\n";
    }
    return 0;
  }

  [[nodiscard]] std::uint64_t overtaken() const try {
    const auto status = fetch_status("echo-status", options_.instance);
    const auto* input = status.find_input(options_.port);
    return input == nullptr || !input->open ? 0 : input->open->overtaken;
  } catch (const std::exception&) {
    return 0;  // the daemon has gone meanwhile
  }

  const EchoOptions& options_;
  shm::FileDescriptor interrupts_;
  Node node_;
  InputPort<void> in_;
  const shm::Nanoseconds started_;
  std::uint64_t samples_ = 0;
  std::map<std::string, std::uint64_t> by_source_;
};

shm::Nanoseconds duration_of(const std::string& text) {
  const auto duration = rules::parse_duration(text);
  if (!duration.problem.empty()) throw CLI::ValidationError("--for", duration.problem);
  return duration.value;
}

int echo(const EchoOptions& options) { return Echo(options, catch_interrupts()).run(); }

}  // namespace

void add_echo(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<EchoOptions>();
  CLI::App* verb = app.add_subcommand("echo", "Open an input port and print what it accepts");
  verb->add_option("PORT", options->port, "The input port's name")->required();
  verb->add_option("--count", options->count, "Stop after this many samples")
      ->type_name("N")
      ->check(at_least_one());
  verb->add_option_function<std::string>(
          "--for", [options](const std::string& text) { options->duration = duration_of(text); },
          "End after this time: 500ms, 10s")
      ->type_name("DURATION");
  verb->add_flag("--json", options->json,
                 "One object a line: {port, source, sequence, stamp_ns, size}");
  add_instance_option(*verb, options->instance);
  verb->footer("Example:\n  arbiter echo /Gaze/pos:i --for 10s");
  verb->callback([options, &exit_code] { exit_code = echo(*options); });
}

}  // namespace arbiter::cli
