#include "gateway/core/account.hpp"

#include <algorithm>
#include <utility>

#include "shm/utf8.hpp"

namespace arbiter::gateway {
namespace {

// Of a reason: it comes from a middleware, or from far away.
constexpr std::size_t kMaxReason = 200;

std::string fitting(std::string_view text, std::size_t most) {
  std::string result = shm::printable(text);
  if (result.size() <= most) return result;
  std::size_t length = most - 3;
  while (length != 0 && (static_cast<unsigned char>(result[length]) & 0xc0) == 0x80) --length;
  return result.substr(0, length) + "...";
}

}  // namespace

Account::Account(std::string outside, std::string other)
    : outside_(std::move(outside)), other_(std::move(other)) {}

void Account::set_peers(std::uint32_t peers, bool at_least) noexcept {
  const std::lock_guard lock(mutex_);
  peers_ = peers;
  at_least_ = at_least;
}

void Account::set_obstacle(std::string_view text) {
  const std::lock_guard lock(mutex_);
  obstacle_ = fitting(text, kMaxReason);
}

void Account::set_last_reason(std::string_view text) {
  const std::lock_guard lock(mutex_);
  last_reason_ = fitting(text, kMaxReason);
}

std::string Account::state_of_topic() const {
  std::string text = shm::printable(outside_);
  if (!obstacle_.empty()) {
    text += ", " + obstacle_;
  } else if (peers_ == 0) {
    text += ", no " + other_ + " matched";
  } else if (peers_ > 0) {
    text += (at_least_ ? ", at least " : ", ") + std::to_string(peers_) + " " + other_ +
            (peers_ == 1 ? "" : "s") + " matched";
  }
  return text;
}

std::string Account::state() const {
  const std::lock_guard lock(mutex_);
  std::string text = state_of_topic();
  if (!last_reason_.empty()) text += "; " + last_reason_;
  return fitting(text, kMaxDescription);
}

std::string Account::text() const {
  const std::lock_guard lock(mutex_);
  std::string text = state_of_topic();
  const std::size_t size = last_size_.load(std::memory_order_relaxed);
  if (passed.value() != 0) {
    text += ", the last sample has " + std::to_string(size) + (size == 1 ? " byte" : " bytes");
  }
  std::string counts;
  const auto add = [&](const Count& count, const char* what) {
    if (count.value() == 0) return;
    counts += (counts.empty() ? "; " : ", ") + std::to_string(count.value()) + " " + what;
  };
  add(late, "late");
  add(too_large, "of a size that does not fit");
  add(unreadable, "unreadable");
  add(no_slot, "without memory");
  add(refused, "refused");
  text += counts;
  if (!last_reason_.empty()) text += "; " + last_reason_;
  return fitting(text, kMaxDescription);
}

}  // namespace arbiter::gateway
