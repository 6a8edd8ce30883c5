#include "gateway/core/bridge.hpp"

#include <poll.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "gateway/core/say.hpp"
#include "shm/clock.hpp"

namespace arbiter::gateway {
namespace {

constexpr shm::Nanoseconds kMillisecond = 1'000'000;
constexpr shm::Nanoseconds kTendPeriod = 100 * kMillisecond;
constexpr shm::Nanoseconds kSayPeriod = 1000 * kMillisecond;  // of each entry
constexpr int kRetryPeriod = 1000;                            // ms

}  // namespace

Bell::Bell() : descriptor_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (descriptor_.get() < 0) {
    throw std::system_error(errno, std::generic_category(), "no descriptor to wake the loop");
  }
}

void Bell::ring() const noexcept {
  const std::uint64_t one = 1;
  static_cast<void>(!::write(descriptor_.get(), &one, sizeof one));
}

void Bell::silence() const noexcept {
  std::uint64_t rings = 0;
  static_cast<void>(!::read(descriptor_.get(), &rings, sizeof rings));
}

Bridge::Part::Part(const Gateway& in, const Entry& of)
    : gateway(in), entry(of), account(of.outside(), of.is_in() ? "publisher" : "subscriber") {}

Bridge::Bridge(BridgeOptions options, const std::vector<Mapping>& mappings, Kind kind,
               const Bell& bell, Middleware& middleware)
    : options_(std::move(options)),
      bell_(bell),
      middleware_(middleware),
      max_ages_(options_.instance),
      epoll_(epoll_create1(EPOLL_CLOEXEC)) {
  for (const Mapping& mapping : mappings) {
    for (const Gateway& gateway : mapping.gateways) {
      if (gateway.kind != kind) continue;
      for (const Entry& entry : gateway.entries) {
        parts_.push_back(std::make_unique<Part>(gateway, entry));
      }
    }
  }
}

Bridge::~Bridge() { middleware_.stop(); }

void Bridge::run(int stop) {
  for (const auto& part : parts_) {
    if (part->entry.is_in()) continue;
    part->sender = &middleware_.sender(part->gateway, part->entry, part->account);
  }
  make_node(stop);
  if (!stops_) open_all(stop);
  if (!stops_) {
    start();
    loop(stop);
  }
  middleware_.stop();
}

bool Bridge::waits(int stop, int milliseconds) {
  pollfd ends{stop, POLLIN, 0};
  return ::poll(&ends, 1, milliseconds) > 0;
}

void Bridge::Saying::say_once(const std::string& text) {
  if (text == last_) return;
  last_ = text;
  if (!text.empty()) say(Level::kWarning, text);
}

void Bridge::make_node(int stop) {
  NodeOptions options;
  options.instance = options_.instance;
  options.connect_timeout = std::chrono::milliseconds(200);
  options.on_waiting = [](const std::string&) {};
  options.on_notice = [](const Notice& notice) { say(Level::kWarning, notice.text); };
  while (!node_) {
    if (options_.on_round) options_.on_round();
    try {
      node_.emplace(options_.name, options);
    } catch (const Error& error) {
      waiting_.say_once(error.what());
      stops_ = waits(stop, kRetryPeriod / 2);
      if (stops_) return;
    }
  }
  waiting_.say_once("");
}

// In the order of their names, and none behind the first that cannot be had: of two gateways that
// have ports in common none must hold what the other one waits for.
std::string Bridge::open_in_order() {
  std::vector<Part*> in_order;
  for (const auto& part : parts_) {
    if (!part->is_open()) in_order.push_back(part.get());
  }
  const auto name_of = [](const Part* part) -> const std::string& {
    return part->entry.ports().front()->name;
  };
  std::sort(in_order.begin(), in_order.end(),
            [&](const Part* a, const Part* b) { return name_of(a) < name_of(b); });
  for (Part* const part : in_order) {
    try {
      open(*part);
    } catch (const Error& error) {
      return error.what();
    }
    if (options_.on_round) options_.on_round();
  }
  return {};
}

void Bridge::open_all(int stop) {
  for (;;) {
    const std::string problem = open_in_order();
    if (options_.on_round) options_.on_round();
    waiting_.say_once(problem);
    if (problem.empty()) {
      for (const auto& part : parts_) part->account.set_obstacle("");
      return;
    }
    for (const auto& part : parts_) {
      part->account.set_obstacle("not served: another port of the gateway is not open, " + problem);
    }
    look_after_all(false);  // why, has been said once for all of them
    stops_ = waits(stop, kRetryPeriod);
    if (stops_) return;
  }
}

void Bridge::open(Part& part) {
  if (part.entry.is_in()) {
    auto incoming = std::make_unique<Incoming>(*node_, part.entry, part.account);
    max_ages_.add(part.entry, incoming->max_age());
    part.incoming = std::move(incoming);
    return;
  }
  auto outgoing =
      std::make_unique<Outgoing>(*node_, part.entry, *part.sender, part.account, max_ages_);
  watch(outgoing->descriptor(), &part);
  part.outgoing = std::move(outgoing);
}

void Bridge::watch(int descriptor, Part* part) const {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.ptr = part;
  if (epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, descriptor, &event) != 0) {
    throw Error(std::string("no descriptor can be watched: ") +
                std::generic_category().message(errno));
  }
}

void Bridge::start() {
  std::vector<Middleware::OpenIn> ins;
  std::vector<Middleware::OpenOut> outs;
  for (const auto& part : parts_) {
    if (part->incoming) {
      ins.push_back({part->gateway, *part->incoming, part->account});
      ins_.emplace(part->entry.ports().front()->name, part->incoming.get());
    }
    if (part->outgoing) outs.push_back({part->gateway, *part->outgoing, part->account});
  }
  for (const auto& out : outs) out.outgoing.lead(ins_, [this] { bell_.ring(); });
  say(Level::kInfo, "serves " + std::to_string(ins.size()) + " topics in, " +
                        std::to_string(outs.size()) + " out");
  middleware_.start(ins, outs);
}

void Bridge::loop(int stop) {
  watch(stop, nullptr);
  watch(bell_.descriptor(), nullptr);
  shm::Nanoseconds tend_at = 0;
  for (bool all = true;;) {
    shm::Nanoseconds now = shm::monotonic_now();
    if (now >= tend_at || all) {
      tend_at = now + kTendPeriod;
      max_ages_.update();
      middleware_.tend();
      look_after_all();
      if (options_.on_round) options_.on_round();
    }
    serve(shm::monotonic_now(), all);
    all = false;
    shm::Nanoseconds next = tend_at;
    for (const auto& part : parts_) {
      if (part->outgoing) next = std::min(next, part->outgoing->next());
    }
    now = shm::monotonic_now();
    const auto wait = std::max<shm::Nanoseconds>(0, next - now + kMillisecond - 1) / kMillisecond;
    std::array<epoll_event, 64> events;
    const int count = epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()),
                                 static_cast<int>(wait));
    if (waits(stop, 0)) return;
    now = shm::monotonic_now();
    for (int i = 0; i < count; ++i) {
      auto* const part = static_cast<Part*>(events[static_cast<std::size_t>(i)].data.ptr);
      if (part != nullptr) {
        part->outgoing->run(now);
      } else {
        bell_.silence();
        all = true;
      }
    }
  }
}

void Bridge::serve(shm::Nanoseconds now, bool all) {
  for (const auto& part : parts_) {
    if (part->outgoing && (all || part->outgoing->next() <= now)) part->outgoing->run(now);
  }
}

void Bridge::look_after_all(bool says) {
  const shm::Nanoseconds now = shm::monotonic_now();
  for (const auto& part : parts_) {
    if (!part->is_open()) continue;
    std::string text = part->account.text();
    if (text != part->described) {
      if (part->incoming) part->incoming->describe(text);
      if (part->outgoing) part->outgoing->describe(text);
      part->described = std::move(text);
    }
    if (!says || now < part->say_again) continue;
    std::string state = part->account.state();
    if (state == part->said) continue;
    part->say_again = now + kSayPeriod;
    say(Level::kInfo, part->entry.ports().front()->name +
                          (part->incoming ? " comes from " : " goes to ") + state);
    part->said = std::move(state);
  }
  const std::string& obstacle = max_ages_.obstacle();
  ages_.say_once(obstacle.empty() ? "" : "T of the sources is not known: " + obstacle);
}

}  // namespace arbiter::gateway
