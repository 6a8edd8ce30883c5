#include "link/exports.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <future>
#include <system_error>
#include <utility>

#include "gateway/core/say.hpp"
#include "link/first_failure.hpp"
#include "link/say_sparingly.hpp"
#include "shm/clock.hpp"

namespace arbiter::link {
namespace {

using gateway::Level;

constexpr shm::Nanoseconds kTapAgain = 5'000'000'000;
constexpr std::size_t kEndAtOnce = 8;

}  // namespace

Exports::Exports(Node& node, const Network& network, const HeldTokens& tokens, std::string host,
                 Incarnation incarnation, const gateway::Bell& bell)
    : node_(node),
      network_(network),
      tokens_(tokens),
      host_(std::move(host)),
      incarnation_(incarnation),
      bell_(bell),
      epoll_(epoll_create1(EPOLL_CLOEXEC)),
      wake_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)),
      demands_(network, EndWatch::Ends::kReaders, readers_) {
  for (const auto& [id, descriptor] :
       {std::pair(kWakeId, wake_.get()), std::pair(kReadersId, readers_.descriptor())}) {
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.u64 = id;
    if (epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, descriptor, &event) != 0) {
      throw std::system_error(errno, std::generic_category(), "no descriptors to watch taps by");
    }
  }
  thread_ = std::thread([this] { run(); });
}

Exports::~Exports() {
  {
    const auto lock = lock_first();
    ends_ = true;
  }
  wake();
  thread_.join();
  // Each may wait for Cyclone until all readers have acknowledged, for WriterLingerDuration at
  // most.
  std::vector<std::unique_ptr<Export>> gone;
  for (auto& [id, one] : exports_) {
    one->tap.reset();
    gone.push_back(std::move(one));
  }
  const auto end_some = [&gone](std::size_t first) {
    for (std::size_t at = first; at < gone.size(); at += kEndAtOnce) gone[at].reset();
  };
  std::vector<std::future<void>> ends;
  for (std::size_t first = 1; first < std::min(kEndAtOnce, gone.size()); ++first) {
    try {
      ends.push_back(std::async(std::launch::async, end_some, first));
    } catch (const std::system_error&) {  // no thread is left
      end_some(first);
    }
  }
  end_some(0);
}

void Exports::wake() const noexcept {
  const std::uint64_t one = 1;
  static_cast<void>(!::write(wake_.get(), &one, sizeof one));
}

void Exports::look(const HostView& view, const Patience& patience) {
  withdraw(view.open_here(), patience);
  FirstFailure failure;
  for (const auto& each : view.open_here()) {
    failure.attempt([&] { offer(each.first, each.second); });
  }
  tap_what_is_wanted(view, patience);
  failure.rethrow();
}

void Exports::withdraw(const HostView::OpenPorts& ports, const Patience& patience) {
  for (auto each = ids_.begin(); each != ids_.end();) {
    const auto one = each++;
    if (ports.contains(one->first)) continue;
    if (!patience.is_left()) return;  // each may wait for readers that acknowledge nothing
    std::unique_ptr<Export> gone;     // its tap is closed without the lock
    {
      const auto lock = lock_first();
      if (in_turn_ == one->second) continue;
      gone = std::move(exports_.at(one->second));
      exports_.erase(one->second);
    }
    ids_.erase(one);
    gone.reset();
    patience.note_call();
  }
}

void Exports::offer(const std::string& source, const shm::TypeInfo& type) {
  const auto id = ids_.find(source);
  if (id != ids_.end()) {
    Export& one = *exports_.at(id->second);
    if (one.tap) return;  // which knows it better: how things stand was asked some time ago
    const auto lock = lock_first();
    static_cast<void>(know_type(one, type));
    return;
  }
  OfferCard card;
  card.incarnation = incarnation_of(last_id_ + 1);
  card.host = host_;
  card.source = source;
  card.type_revision = 1;
  card.type = type;
  auto one = std::make_unique<Export>(network_, std::move(card), readers_);
  const auto lock = lock_first();
  exports_.emplace(++last_id_, std::move(one));
  ids_.emplace(source, last_id_);
  readers_.ring();  // those that came before it was here
}

Incarnation Exports::incarnation_of(std::uint64_t id) const noexcept {
  const Incarnation incarnation = incarnation_ + id;
  return incarnation != 0 ? incarnation : incarnation_;  // which no other id leads to
}

void Exports::tap_what_is_wanted(const HostView& view, const Patience& patience) {
  for (const auto& [source, id] : ids_) {
    Export& one = *exports_.at(id);
    {
      const auto lock = lock_first();
      if (in_turn_ == id || one.is_wanted == one.tap.has_value()) continue;
    }
    if (one.tap) {
      close_tap(one, id);
    } else if (shm::monotonic_now() >= one.tap_again && patience.is_left()) {
      open_tap(one, id, view);
      patience.note_call();
    }
  }
}

void Exports::close_tap(Export& one, std::uint64_t id) {
  std::optional<Tap<void>> gone;
  const auto lock = lock_first();
  if (in_turn_ == id) return;
  gone.swap(one.tap);
  one.kept.end();
  has_closed_ = true;
  wake();
}

// The other thread uses a tap once it is in the export, and not before.
void Exports::open_tap(Export& one, std::uint64_t id, const HostView& view) {
  try {
    Tap<void> tap = node_.tap(one.card.source);
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.u64 = id;
    const int descriptor = tap.fd();
    const auto lock = lock_first();
    one.tap = std::move(tap);
    if (epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, descriptor, &event) != 0) {
      one.tap.reset();
      throw Error("no descriptor can be watched");
    }
    one.said.clear();
    // Its publisher tells the tap of the source at its next arrival, which may be a long time away.
    one.is_deactivated = view.is_deactivated(one.card.source);
    one.is_unsaid = true;
    ready_.insert(id);  // a tap rings once somebody has found nothing in it
    wake();
  } catch (const Error& error) {
    one.tap_again = shm::monotonic_now() + kTapAgain;
    if (one.said == error.what()) return;
    const std::string text =
        one.card.source + " cannot be sent to the hosts that want it: " + error.what();
    if (say_sooner_or_later(Level::kWarning, text)) one.said = error.what();
  }
}

std::unique_lock<std::mutex> Exports::lock_first() {
  const std::lock_guard gate(gate_);
  return std::unique_lock(mutex_);
}

std::unique_lock<std::mutex> Exports::lock_after() {
  { const std::lock_guard gate(gate_); }
  return std::unique_lock(mutex_);
}

}  // namespace arbiter::link
