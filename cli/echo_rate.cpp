// How often samples arrive, how regularly, and how many bytes they have: once a second, by source.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <map>
#include <optional>

#include <nlohmann/json.hpp>

#include "cli/broken_pipe.hpp"
#include "cli/echo.hpp"
#include "cli/live.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"

namespace arbiter::cli {
namespace {

constexpr shm::Nanoseconds kSecond = 1'000'000'000;
// How often the tap is looked at: a publisher keeps 1024 events, so that none is lost up to 50 kHz.
constexpr shm::Nanoseconds kLookInterval = 20'000'000;

// Of one source, since the last line.
class Rate {
 public:
  void note(shm::Nanoseconds time, std::size_t size) {
    bytes_ += size;
    ++samples_;
    if (last_ != 0) note_interval(static_cast<double>(time - last_));
    last_ = time;
  }
  // What comes next is behind a gap.
  void forget_last() { last_ = 0; }

  [[nodiscard]] std::uint64_t samples() const { return samples_; }
  [[nodiscard]] double hz(double seconds) const { return static_cast<double>(samples_) / seconds; }
  [[nodiscard]] double bytes_per_second(double seconds) const {
    return static_cast<double>(bytes_) / seconds;
  }
  // The standard deviation of the time between two arrivals, and the longest such time; nothing:
  // there were not enough of them.
  [[nodiscard]] std::optional<double> jitter_ns() const {
    if (intervals_ < 2) return std::nullopt;
    return std::sqrt(squares_ / static_cast<double>(intervals_));
  }
  [[nodiscard]] std::optional<double> longest_ns() const {
    return intervals_ == 0 ? std::nullopt : std::optional(longest_);
  }
  void begin_again() { *this = Rate(last_); }

  Rate() = default;

 private:
  explicit Rate(shm::Nanoseconds last) : last_(last) {}
  // Welford's, which loses no digits.
  void note_interval(double interval) {
    ++intervals_;
    const double before = interval - mean_;
    mean_ += before / static_cast<double>(intervals_);
    squares_ += before * (interval - mean_);
    longest_ = std::max(longest_, interval);
  }

  std::uint64_t samples_ = 0;
  std::uint64_t bytes_ = 0;
  std::uint64_t intervals_ = 0;
  double mean_ = 0;
  double squares_ = 0;
  double longest_ = 0;
  shm::Nanoseconds last_ = 0;
};

std::string with_digits(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

// "0.032 ms"; "-": there is none.
std::string span_of_rate(const std::optional<double>& ns) {
  return ns ? with_digits(*ns / 1e6, 3) + " ms" : "-";
}

nlohmann::json json_of_rate(const std::optional<double>& ns) {
  return ns ? nlohmann::json(std::llround(*ns)) : nlohmann::json(nullptr);
}

std::string bytes_text(double bytes) {
  if (bytes >= 1e6) return with_digits(bytes / 1e6, 2) + " MB/s";
  if (bytes >= 1e3) return with_digits(bytes / 1e3, 2) + " kB/s";
  return with_digits(bytes, 0) + " B/s";
}

class RateEcho {
 public:
  RateEcho(const EchoOptions& options, TapOf of, EchoNews& news,
           const shm::FileDescriptor& interrupts)
      : options_(options),
        is_input_(of == TapOf::input),
        news_(news),
        interrupts_(interrupts),
        node_("arbiter-echo", echo_node_options(options)),
        tap_(node_.tap(options.port, tap_options(of))) {}

  int run() {
    const shm::Nanoseconds started = shm::monotonic_now();
    const shm::Nanoseconds end = end_of_echo(options_, started);
    shm::Nanoseconds line = started;
    Looked looked = Looked::kNothing;
    while (std::cout && !has_reader_gone()) {
      const shm::Nanoseconds next = std::min(line + kSecond, end);
      const bool is_interrupted =
          sleep_until(std::min(shm::monotonic_now() + pause_after(looked), next), interrupts_);
      looked = look();
      news_.tell();
      const shm::Nanoseconds now = shm::monotonic_now();
      if (now < next && !is_interrupted) continue;
      print(static_cast<double>(now - line) / kSecond);
      line = now;
      if (is_interrupted || now >= end || ++lines_ == options_.count) break;
    }
    if (tap_.lost() != 0) {
      std::cerr << "arbiter: " << rules::counted(tap_.lost(), "event")
                << " came faster than they could be counted\n";
    }
    return 0;
  }

 private:
  static TapOptions tap_options(TapOf of) {
    TapOptions options;
    options.of = of;
    options.max_held = 0;
    options.may_wait = false;
    return options;
  }

  static shm::Nanoseconds pause_after(Looked looked) {
    return looked == Looked::kMore ? 0 : kLookInterval;
  }

  Looked look() {
    for (int i = 0; i < kMostOfLook; ++i) {
      const auto event = tap_.take();
      if (!event) return Looked::kNothing;
      if (event->count() != 0) continue;  // of what has been counted already
      Rate& rate = rates_[event->source()];
      if (event->lost() != 0) rate.forget_last();
      if (event->kind() != TapEventKind::sample) continue;
      const bool is_counted =
          !is_input_ || options_.losers || event->at(options_.port) == Fate::accepted;
      if (is_counted) rate.note(event->time().time_since_epoch().count(), event->size());
    }
    return Looked::kMore;
  }

  void print(double seconds) {
    for (auto& [source, rate] : rates_) {
      if (options_.json) {
        std::cout << nlohmann::json{{"port", options_.port},
                                    {"source", source},
                                    {"samples", rate.samples()},
                                    {"hz", rate.hz(seconds)},
                                    {"jitter_ns", json_of_rate(rate.jitter_ns())},
                                    {"longest_ns", json_of_rate(rate.longest_ns())},
                                    {"bytes_per_second", rate.bytes_per_second(seconds)}}
                         .dump()
                  << '\n';
      } else {
        std::cout << source << "  " << with_digits(rate.hz(seconds), 1) << " Hz  jitter "
                  << span_of_rate(rate.jitter_ns()) << "  longest "
                  << span_of_rate(rate.longest_ns()) << "  "
                  << bytes_text(rate.bytes_per_second(seconds)) << '\n';
      }
      rate.begin_again();
    }
    std::cout.flush();
  }

  const EchoOptions& options_;
  const bool is_input_;
  EchoNews& news_;
  const shm::FileDescriptor& interrupts_;
  Node node_;
  Tap<> tap_;
  std::map<std::string, Rate> rates_;
  std::uint64_t lines_ = 0;
};

}  // namespace

int echo_rate(const EchoOptions& options, const shm::FileDescriptor& interrupts) {
  EchoNews news(options.instance, options.port, interrupts);
  return RateEcho(options, kind_of_port(options, news.instance()), news, interrupts).run();
}

}  // namespace arbiter::cli
