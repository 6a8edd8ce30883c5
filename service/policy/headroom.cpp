#include "service/policy/headroom.hpp"

#include <algorithm>

#include "wire/messages.hpp"

namespace arbiter::service {
namespace {

constexpr rlim_t kWanted = 256;
static_assert(kWanted >= wire::kMostDescriptorsOfAMessage);

}  // namespace

const Headroom& Headroom::of_the_process() {
  static const Headroom headroom;
  return headroom;
}

Headroom::Headroom() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return;
  whole_ = limit.rlim_cur;
  lowered_ = whole_ - std::min(kWanted, whole_ / 4);
  set(lowered_);
}

bool Headroom::is_enough() const {
  return whole_ == RLIM_INFINITY || whole_ - lowered_ >= wire::kMostDescriptorsOfAMessage;
}

void Headroom::set(rlim_t limit) {
  rlimit limits{};
  if (getrlimit(RLIMIT_NOFILE, &limits) != 0) return;
  limits.rlim_cur = limit;
  setrlimit(RLIMIT_NOFILE, &limits);
}

Headroom::Use::Use() { set(of_the_process().whole_); }
Headroom::Use::~Use() { set(of_the_process().lowered_); }

}  // namespace arbiter::service
