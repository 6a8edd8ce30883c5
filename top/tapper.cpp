#include "top/tapper.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include "top/signals_blocked.hpp"

namespace arbiter::top {
namespace {

NodeOptions node_options(const std::string& instance) {
  NodeOptions options;
  options.instance = instance;
  options.connect_timeout = std::chrono::milliseconds(300);
  // Nothing may be written beside the screen. Refusals of sources that come later are told by
  // nobody: the port's other sources are tapped all the same.
  options.on_waiting = [](const std::string&) {};
  options.on_notice = [](const Notice&) {};
  return options;
}

constexpr shm::Nanoseconds kCountEvery = 1'000'000'000;
constexpr std::size_t kCounts = 10;

TapOptions tap_options() {
  TapOptions options;
  options.of = TapOf::input;
  options.max_held = 0;
  options.may_wait = false;
  return options;
}

}  // namespace

Tapper::~Tapper() {
  if (!thread_.joinable()) return;
  thread_.request_stop();
  thread_.join();
}

void Tapper::watch(const std::set<std::string>& ports) {
  std::erase_if(taps_, [&](const auto& tap) { return ports.count(tap.first) == 0; });
  std::vector<std::string> added;
  std::set_difference(ports.begin(), ports.end(), wanted_.begin(), wanted_.end(),
                      std::back_inserter(added));
  wanted_ = ports;
  problem_.clear();
  if (added.empty()) return;
  {
    const std::lock_guard lock(mutex_);
    to_open_.insert(to_open_.end(), added.begin(), added.end());
  }
  asked_.notify_one();
  if (thread_.joinable()) return;
  const SignalsBlocked blocked;
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

// The node lives here: its taps keep it where they outlive it.
void Tapper::run(const std::stop_token& stop) {
  std::optional<Node> node;
  for (;;) {
    std::string port;
    {
      std::unique_lock lock(mutex_);
      asked_.wait(lock, stop, [this] { return !to_open_.empty(); });
      if (stop.stop_requested()) return;
      port = to_open_.front();
      to_open_.erase(to_open_.begin());
    }
    try {
      if (!node) node.emplace("arbiter-top", node_options(instance_));
      Tap<> tap = node->tap(port, tap_options());
      const std::lock_guard lock(mutex_);
      opened_.emplace_back(port, std::move(tap));
    } catch (const std::exception& error) {
      const std::lock_guard lock(mutex_);
      refused_.emplace_back(port, error.what());
    }
  }
}

void Tapper::take_up_opened() {
  std::vector<std::pair<std::string, Tap<>>> opened;
  {
    const std::lock_guard lock(mutex_);
    opened.swap(opened_);
  }
  for (auto& [port, tap] : opened) {
    if (wanted_.count(port) != 0) taps_.insert_or_assign(port, Tapped{std::move(tap)});
  }
}

std::vector<std::string> Tapper::take_refused() {
  std::vector<std::pair<std::string, std::string>> refused;
  {
    const std::lock_guard lock(mutex_);
    refused.swap(refused_);
  }
  std::vector<std::string> ports;
  for (auto& [port, why] : refused) {
    problem_ = "not tapped: " + why;
    wanted_.erase(port);
    ports.push_back(std::move(port));
  }
  return ports;
}

std::vector<Accepted> Tapper::collect() {
  take_up_opened();
  std::vector<Accepted> result;
  for (auto& [port, tapped] : taps_) {
    Tap<>& tap = tapped.tap;
    while (const auto event = tap.take()) {
      if (event->at(port) != Fate::accepted) continue;
      result.push_back({port, event->source(), event->time().time_since_epoch().count(),
                        event->kind() == TapEventKind::sample, event->generation()});
    }
    if (tap.lost() != 0) {
      problem_ = "of " + port + ", " + std::to_string(tap.lost()) +
                 (tap.lost() == 1 ? " event" : " events") + " came faster than they could be read";
    }
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const Accepted& a, const Accepted& b) { return a.at < b.at; });
  return result;
}

std::map<std::string, std::optional<Waits>> Tapper::tapped(shm::Nanoseconds now) {
  std::map<std::string, std::optional<Waits>> ports;
  for (auto& [port, tapped] : taps_) {
    auto& counted = tapped.counted;
    const Latencies counts = tapped.tap.latencies();
    const Latencies lately = counted.empty() ? counts : counts.since(counted.front().second);
    if (counted.empty() || now - counted.back().first >= kCountEvery) {
      counted.emplace_back(now, counts);
      if (counted.size() > kCounts) counted.pop_front();
    }
    auto& waits = ports[port];
    if (lately.samples() == 0) continue;
    waits = Waits{lately.percentile(0.5).count(), lately.percentile(0.99).count()};
  }
  return ports;
}

}  // namespace arbiter::top
