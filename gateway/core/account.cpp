#include "gateway/core/account.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "shm/utf8.hpp"

namespace arbiter::gateway {
namespace {

// They come from a middleware, or from far away. An obstacle ends with what to do about it.
constexpr std::size_t kMaxObstacle = 400;
constexpr std::size_t kMaxReason = 200;

constexpr std::int64_t kOneSecond = 1'000'000'000;
constexpr std::int64_t kRatePeriod = 2 * kOneSecond;
constexpr std::int64_t kSteadyPeriod = 20 * kOneSecond;

// Since the last sample; the longest first.
constexpr std::array<std::pair<std::int64_t, const char*>, 5> kAges{{{86400 * kOneSecond, "a day"},
                                                                     {3600 * kOneSecond, "an hour"},
                                                                     {600 * kOneSecond, "10 min"},
                                                                     {60 * kOneSecond, "a minute"},
                                                                     {10 * kOneSecond, "10 s"}}};

std::string fitting(std::string_view text, std::size_t most) {
  std::string result = shm::printable(text);
  if (result.size() <= most) return result;
  return std::string(shm::beginning_of(result, most - 3)) + "...";
}

}  // namespace

Account::Account(std::string outside, std::string other)
    : outside_(std::move(outside)), other_(std::move(other)) {}

void Account::set_peers(std::uint32_t peers, bool at_least) noexcept {
  const std::lock_guard lock(mutex_);
  peers_ = peers;
  at_least_ = at_least;
}

bool Account::may_have_peers() const noexcept {
  const std::lock_guard lock(mutex_);
  return peers_ != 0;
}

void Account::set_place(std::string place) {
  const std::lock_guard lock(mutex_);
  place_ = std::move(place);
}

void Account::set_obstacle(std::string_view text, bool is_trouble) {
  const std::lock_guard lock(mutex_);
  obstacle_ = fitting(text, kMaxObstacle);
  is_trouble_ = is_trouble && !text.empty();
}

bool Account::is_trouble() const {
  const std::lock_guard lock(mutex_);
  return is_trouble_;
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
    text += ", no " + other_ + " matched" + place_;
  } else if (peers_ > 0) {
    text += (at_least_ ? ", at least " : ", ") + std::to_string(peers_) + " " + other_ +
            (peers_ == 1 ? "" : "s") + " matched";
  }
  return text;
}

void Account::look(std::int64_t now) noexcept {
  const std::lock_guard lock(mutex_);
  const std::uint64_t count = passed.value();
  const bool has_passed = count != passed_before_;
  passed_before_ = count;
  looked_at_ = now;
  if (has_passed) passed_at_ = now;
  if (is_silent_ && has_passed) {
    is_silent_ = false;
    recent_ = steady_ = {now, count};  // the silence before is no part of the rate
  } else if (!is_silent_ && now - recent_.since >= kRatePeriod) {
    measure(now, count);
  }
}

double Account::Window::rate(std::int64_t now, std::uint64_t count) const noexcept {
  return static_cast<double>(count - passed) * 1e9 / static_cast<double>(now - since);
}

// A period more or less of a steady publisher, or a little jitter, is no news; over a longer time
// neither counts for much.
void Account::measure(std::int64_t now, std::uint64_t count) noexcept {
  const double rate = recent_.rate(now, count);
  is_silent_ = rate == 0;
  const double periods = 1.5e9 / static_cast<double>(now - recent_.since);
  if (rate == 0 || std::abs(rate - rate_) > std::max(0.2 * rate_, periods)) {
    rate_ = rate;
    steady_ = {now, count};
  } else if (now - steady_.since >= kSteadyPeriod) {
    const double exact = steady_.rate(now, count);
    if (std::abs(exact - std::round(rate_)) > std::max(0.02 * rate_, 0.6)) rate_ = exact;
    steady_ = {now, count};
  }
  recent_ = {now, count};
}

std::string Account::traffic() const {
  if (passed.value() == 0) return "";
  const std::size_t size = last_size_.load(std::memory_order_relaxed);
  const std::string bytes = std::to_string(size) + (size == 1 ? " byte" : " bytes");
  if (rate_ >= 0.75) {
    const auto whole = static_cast<std::uint64_t>(std::llround(rate_));
    return ", " + std::to_string(whole) + (whole == 1 ? " sample" : " samples") +
           " a second, the last one has " + bytes;
  }
  std::string text = ", the last sample has " + bytes;
  for (const auto& [age, in_words] : kAges) {
    if (looked_at_ - passed_at_ >= age) return text + " and is over " + in_words + " old";
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
  std::string text = state_of_topic() + traffic();
  // Ten more in a second would be ten texts.
  if (const std::uint64_t count = idle.value(); count != 0) {
    std::uint64_t step = 1;
    while (count / step >= 10) step *= 10;
    text += ", at least " + std::to_string(step) + (step == 1 ? " idle sample" : " idle samples");
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
  add(overflows, "or more lost to a full queue");
  text += counts;
  if (!last_reason_.empty()) text += "; " + last_reason_;
  return fitting(text, kMaxDescription);
}

}  // namespace arbiter::gateway
