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
// Between two looks while a port is not open.
constexpr shm::Nanoseconds kLookPeriod = 100 * kMillisecond;
constexpr shm::Nanoseconds kTellPeriod = 500 * kMillisecond;  // how things stand
constexpr int kRetryPeriod = 500;                             // ms, for the daemon
// One lost datagram must not leave a robot driving, nor a gateway end late.
constexpr int kLeaves = 3;
constexpr int kLeavePeriod = 20;  // ms
constexpr shm::Nanoseconds kOpenPeriod = 1000 * kMillisecond;
// A daemon refuses at once, unless it waits for somebody to yield.
constexpr shm::Nanoseconds kNoAnswer = 100 * kMillisecond;
constexpr shm::Nanoseconds kSilence = 400 * kMillisecond;
// A try that has held up the loop is made again after so many times as long.
constexpr int kTimesAsLong = 20;
// In a round of the loop, which goes round ten times a second then.
constexpr shm::Nanoseconds kOpenBudget = 10 * kMillisecond;

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
  try {
    if (!stops_) loop(stop);
  } catch (const LostPorts&) {
    take_leave();
    throw;
  }
  take_leave();
  middleware_.stop();
}

void Bridge::take_leave() {
  std::vector<Outgoing*> outs;
  for (const auto& part : parts_) {
    if (part->outgoing && part->entry.idle.kind != Idle::Kind::kNothing) {
      outs.push_back(part->outgoing.get());
    }
  }
  if (outs.empty()) return;
  for (int i = 0; i < kLeaves; ++i) {
    if (i != 0) ::poll(nullptr, 0, kLeavePeriod);
    for (Outgoing* const out : outs) out->end();
  }
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
  // Once there is a node: a port waits for a daemon that has gone. It does not wait any longer.
  options.on_waiting = [this](const std::string&) {
    if (node_) throw Error("no daemon answers");
  };
  options.on_notice = [](const Notice& notice) { say(Level::kWarning, notice.text); };
  while (!node_) {
    if (options_.on_round) options_.on_round();
    try {
      node_.emplace(options_.name, options);
    } catch (const Error& error) {
      waiting_.say_once(error.what());
      stops_ = waits(stop, kRetryPeriod);
      if (stops_) return;
    }
  }
  waiting_.say_once("");
}

// The loop has others to serve: it waits at most once for a daemon that does not answer, and seldom
// again; and it tries some ports after others where many are refused.
void Bridge::open_closed() {
  const shm::Nanoseconds begin = shm::monotonic_now();
  open_again_ = begin + kOpenPeriod;
  if (has_started_ && max_ages_.knows_of_no_daemon()) return;
  shm::Nanoseconds pause = kOpenPeriod;
  SpareDescriptors spare;
  std::vector<Part*> opened;
  for (std::size_t tried = 0; tried < parts_.size(); ++tried) {
    Part& part = *parts_[open_next_];
    open_next_ = (open_next_ + 1) % parts_.size();
    if (part.is_open()) continue;
    const shm::Nanoseconds before = shm::monotonic_now();
    if (try_to_open(part, spare)) opened.push_back(&part);
    if (options_.on_round) options_.on_round();
    const shm::Nanoseconds now = shm::monotonic_now();
    if (!part.is_open() && now - before > (has_started_ ? kNoAnswer : kSilence)) {
      // While none is open nobody is held up.
      if (is_any(true)) pause = std::max(kOpenPeriod, kTimesAsLong * (now - before));
      break;
    }
    if (has_started_ && now - begin > kOpenBudget) {
      pause = 0;  // at the next round
      break;
    }
  }
  spare.let_go();
  if (!opened.empty() || !has_started_) start(opened);
  open_again_ = shm::monotonic_now() + pause;
}

bool Bridge::is_any(bool open) const {
  return std::any_of(parts_.begin(), parts_.end(),
                     [open](const auto& part) { return part->is_open() == open; });
}

bool Bridge::try_to_open(Part& part, SpareDescriptors& spare) {
  try {
    if (!spare.leave_room()) {
      throw Error(
          "no descriptors are left for it: raise RLIMIT_NOFILE (ulimit -n, LimitNOFILE= in a "
          "systemd unit)");
    }
    open(part);
    part.waiting.say_once("");
    return true;
  } catch (const Error& error) {
    part.waiting.say_once(part.entry.ports().front()->name + " is not served: " + error.what() +
                          "; trying again");
    return false;
  }
}

void Bridge::open(Part& part) {
  if (part.entry.is_in()) {
    auto incoming = std::make_unique<Incoming>(*node_, part.entry, part.account, &part.first);
    max_ages_.add(part.entry, incoming->max_age());
    part.incoming = std::move(incoming);
    return;
  }
  auto outgoing =
      std::make_unique<Outgoing>(*node_, part.entry, *part.sender, part.account, max_ages_);
  watch(outgoing->descriptor(), &part);
  part.outgoing = std::move(outgoing);
}

void Bridge::watch(int descriptor, const void* whose) const {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.ptr = const_cast<void*>(whose);
  if (epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, descriptor, &event) != 0) {
    throw Error(std::string("no descriptor can be watched: ") +
                std::generic_category().message(errno));
  }
}

void Bridge::watch_news() {
  if (watches_news_ || max_ages_.descriptor() < 0) return;
  watch(max_ages_.descriptor(), &max_ages_);
  watches_news_ = true;
}

void Bridge::start(const std::vector<Part*>& opened) {
  std::vector<Middleware::OpenIn> ins;
  std::vector<Middleware::OpenOut> outs;
  for (Part* const part : opened) {
    if (part->incoming) {
      ins.push_back({part->gateway, *part->incoming, part->account});
      for (const Port* port : part->entry.ports())
        feeds_.emplace(port->name, &part->incoming->feed());
    }
    if (part->outgoing) outs.push_back({part->gateway, *part->outgoing, part->account});
    if (has_started_) say(Level::kInfo, part->entry.ports().front()->name + " is served now");
  }
  for (const auto& out : outs) out.outgoing.lead(feeds_, [this] { bell_.ring(); });
  if (!has_started_) {
    say(Level::kInfo, "serves " + std::to_string(ins.size()) +
                          (ins.size() == 1 ? " topic in, " : " topics in, ") +
                          std::to_string(outs.size()) + " out");
  }
  has_started_ = true;
  middleware_.start(ins, outs);
}

void Bridge::loop(int stop) {
  watch(stop, nullptr);
  watch(bell_.descriptor(), &bell_);
  for (bool all = true;;) {
    look_after(shm::monotonic_now(), all);
    serve(shm::monotonic_now(), all);
    all = false;
    const shm::Nanoseconds now = shm::monotonic_now();
    const auto wait = std::max<shm::Nanoseconds>(0, next_round() - now + kMillisecond - 1);
    if (!hear(static_cast<int>(wait / kMillisecond), all)) return;
  }
}

void Bridge::look_after(shm::Nanoseconds now, bool all) {
  if (now < tend_at_ && !all) return;
  const bool tells = all || now >= tell_at_;
  // First: what the middleware subscribes to depends on T.
  if (tells) max_ages_.update();
  if (now >= open_again_) open_closed();
  middleware_.tend();
  if (tells) {
    watch_news();
    look_after_all();
    if (options_.on_turned_away && max_ages_.is_turned_away(options_.name)) {
      options_.on_turned_away();
    }
    tell_at_ = shm::monotonic_now() + kTellPeriod;
    // To ask whether it is turned away may have taken up the news of another model.
    if (max_ages_.is_outdated()) bell_.ring();
  }
  // From here on: who was held up above serves before the next round.
  tend_at_ = shm::monotonic_now() + (is_any(false) ? kLookPeriod : middleware_.tend_period());
  if (options_.on_round) options_.on_round();
}

shm::Nanoseconds Bridge::next_round() const {
  shm::Nanoseconds next = tend_at_;
  for (const auto& part : parts_) {
    if (part->outgoing) next = std::min(next, part->outgoing->next());
  }
  return next;
}

bool Bridge::hear(int milliseconds, bool& all) {
  std::array<epoll_event, 64> events;
  const int count =
      epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), milliseconds);
  const shm::Nanoseconds now = shm::monotonic_now();
  for (int i = 0; i < count; ++i) {
    void* const whose = events[static_cast<std::size_t>(i)].data.ptr;
    if (whose == nullptr) return false;
    if (whose == &bell_) {
      bell_.silence();
      all = true;
    } else if (whose == &max_ages_) {
      all = max_ages_.update() || all;
    } else {
      static_cast<Part*>(whose)->outgoing->run(now);
    }
  }
  return true;
}

void Bridge::serve(shm::Nanoseconds now, bool all) {
  for (const auto& part : parts_) {
    if (part->outgoing && (all || part->outgoing->next() <= now)) part->outgoing->run(now);
  }
}

void Bridge::look_after_all() {
  const shm::Nanoseconds now = shm::monotonic_now();
  for (const auto& part : parts_) {
    if (!part->is_open()) continue;
    part->account.look(now);
    std::string text = part->account.text();
    const bool is_trouble = part->account.is_trouble();
    if (text != part->described || is_trouble != part->is_trouble) {
      if (part->incoming) part->incoming->describe(text, is_trouble);
      if (part->outgoing) part->outgoing->describe(text, is_trouble);
      part->described = std::move(text);
      part->is_trouble = is_trouble;
    }
    const std::string state = part->account.state();
    if (!part->news.take(state, now)) continue;
    say(Level::kInfo, part->entry.ports().front()->name +
                          (part->incoming ? " comes from " : " goes to ") + state);
  }
  const std::string& obstacle = max_ages_.obstacle();
  ages_.say_once(obstacle.empty() ? "" : "T of the sources is not known: " + obstacle);
}

}  // namespace arbiter::gateway
