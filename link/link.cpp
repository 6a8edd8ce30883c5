#include "link/link.hpp"

#include <poll.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "gateway/core/say.hpp"
#include "gateway/dds/domain.hpp"
#include "shm/clock.hpp"

namespace arbiter::link {
namespace {

using gateway::Level;
using gateway::say;

constexpr int kLookPeriod = 100;    // ms
constexpr int kRetryPeriod = 1000;  // ms

Incarnation new_incarnation() {
  Incarnation incarnation = 0;
  while (incarnation == 0) {
    if (::getrandom(&incarnation, sizeof incarnation, 0) != sizeof incarnation && errno != EINTR) {
      throw std::system_error(errno, std::generic_category(), "no random number");
    }
  }
  return incarnation;
}

std::string name_of(const NetworkOptions& network) {
  if (network.interfaces.empty()) {
    return "the loopback interface: nothing leaves this machine (--interface names a network)";
  }
  std::string text;
  for (const std::string& each : network.interfaces) text += (text.empty() ? "" : ", ") + each;
  return text;
}

}  // namespace

Link::Link(LinkOptions options)
    : options_(std::move(options)), incarnation_(new_incarnation()), view_(options_.instance) {
  gateway::dds::hear_cyclone();
}

void Link::run(int stop) {
  make_node(stop);
  if (!stops_) join_network(stop);
  if (!stops_) loop(stop);
}

bool Link::waits(int stop, int milliseconds) const {
  std::array<pollfd, 2> ends{{{stop, POLLIN, 0}, {bell_.descriptor(), POLLIN, 0}}};
  static_cast<void>(::poll(ends.data(), ends.size(), milliseconds));
  bell_.silence();
  return (ends[0].revents & POLLIN) != 0;
}

void Link::say_once(std::string& said, const std::string& text) {
  if (text == said) return;
  said = text;
  if (!text.empty()) say(Level::kWarning, text);
}

void Link::make_node(int stop) {
  NodeOptions options;
  options.instance = options_.instance;
  options.connect_timeout = std::chrono::milliseconds(200);
  options.on_waiting = [](const std::string&) {};
  options.on_notice = [](const Notice& notice) { say(Level::kWarning, notice.text); };
  while (!node_ && !stops_) {
    options_.on_round();
    try {
      node_.emplace(kNodeName, options);
    } catch (const Error& error) {
      say_once(said_, error.what());
      stops_ = waits(stop, kRetryPeriod / 2);
    }
  }
}

// An interface may come later.
void Link::join_network(int stop) {
  while (!network_ && !stops_) {
    options_.on_round();
    const gateway::dds::CycloneWords words;
    try {
      network_.emplace(options_.network);
    } catch (const DdsError& error) {
      say_once(said_,
               (words.last().empty() ? error.what() : "DDS: " + words.last()) + "; trying again");
      stops_ = waits(stop, kRetryPeriod);
    }
  }
  if (stops_) return;
  tokens_.emplace(*network_, [this](const TokenMessage& message) {
    held_.note(message.importer, message.number, shm::monotonic_now());
  });
  exports_.emplace(*node_, *network_, held_, options_.host, incarnation_, bell_);
  clock_.emplace([this] { tokens_->send({incarnation_, sent_.next(time_with_sleep())}); });
  say(Level::kInfo, "host " + options_.host + ", on " + name_of(options_.network));
}

void Link::loop(int stop) {
  std::string said_of_exports;
  std::string said_of_imports;
  // What fails on one side does not hold up the other.
  const auto attempt = [this](std::string& said, const auto& step) {
    try {
      step();
      said.clear();
    } catch (const DdsError& error) {  // memory is short
      say_once(said, error.what());
    }
  };
  for (; !stops_; stops_ = waits(stop, kLookPeriod)) {
    options_.on_round();
    view_.update();
    say_once(said_of_view_, view_.obstacle());
    options_.on_round();
    const Patience patience([] { return shm::monotonic_now(); }, options_.on_round);
    attempt(said_of_exports, [&] { exports_->look(view_, patience); });
    attempt(said_of_imports, [&] { choose_imports(patience); });
  }
}

// What is to be closed is closed before anything waits for the daemon.
void Link::choose_imports(const Patience& patience) {
  const auto& wanted = view_.wanted();
  std::erase_if(imports_, [&](const auto& each) { return !wanted.contains(each.first); });
  for (const auto& [source, one] : imports_) {
    one->set_max_age(wanted.find(source)->second);
    one->look(view_.open_here().contains(source));
  }
  shm::Nanoseconds shortest = 0;  // no import
  for (const auto& [source, age] : wanted) {
    shortest = shortest == 0 ? age : std::min(shortest, age);
  }
  clock_->set_period(shortest == 0 ? 0 : token_period(shortest));
  for (const auto& [source, one] : imports_) one->open(view_.has_daemon(), patience);
  for (const auto& [source, age] : wanted) {
    std::unique_ptr<Import>& one = imports_[source];
    if (one != nullptr) continue;
    one = std::make_unique<Import>(*node_, *network_, sent_, source, incarnation_, bell_);
  }
}

}  // namespace arbiter::link
