#include "service/ports/refusals.hpp"

#include <algorithm>
#include <utility>

namespace arbiter::service {
namespace {

std::optional<std::string>& port_of(wire::RefusalStatus& refusal, Refusals::End end) {
  return end == Refusals::End::kOutput ? refusal.output : refusal.input;
}

}  // namespace

bool Refusals::note(const Client& client, End end, const std::string& port, const std::string& why,
                    shm::Nanoseconds now) {
  wire::RefusalStatus refusal;
  refusal.node = client.name;
  refusal.pid = client.pid();
  refusal.user = client.user();
  refusal.at = now;
  refusal.why = why;
  port_of(refusal, end) = port;
  bool is_news = true;
  const auto same = std::find_if(refusals_.begin(), refusals_.end(), [&](auto& each) {
    return each.user == refusal.user && each.node == refusal.node && port_of(each, end) == port;
  });
  if (same != refusals_.end()) {
    is_news = same->pid != refusal.pid || same->why != why;
    refusals_.erase(same);
  } else {
    make_room(refusal.user);
  }
  refusals_.push_front(std::move(refusal));
  return is_news;
}

void Refusals::forget(End end, const std::string& port) {
  std::erase_if(refusals_, [&](auto& each) { return port_of(each, end) == port; });
}

void Refusals::make_room(std::uint32_t user) {
  const auto is_of_user = [&](const wire::RefusalStatus& each) { return each.user == user; };
  const auto own = std::count_if(refusals_.begin(), refusals_.end(), is_of_user);
  if (static_cast<std::size_t>(own) >= kMostOfUser) {
    const auto oldest = std::find_if(refusals_.rbegin(), refusals_.rend(), is_of_user);
    refusals_.erase(std::next(oldest).base());
  } else if (refusals_.size() == kMost) {
    refusals_.pop_back();
  }
}

}  // namespace arbiter::service
