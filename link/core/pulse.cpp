#include "link/core/pulse.hpp"

#include <algorithm>

#include "link/core/card_bytes.hpp"

namespace arbiter::link {
namespace {

constexpr std::uint32_t kPulseMagic = 0x50425241;  // "ARBP"

}  // namespace

ByteString write_pulse(const Pulse& pulse) {
  CardWriter writer(kPulseMagic, pulse.sender);
  writer.number(pulse.number);
  writer.number(static_cast<std::uint16_t>(pulse.echoes.size()));
  for (const Echo& echo : pulse.echoes) {
    writer.number(echo.of);
    writer.number(echo.number);
    writer.number(echo.lay);
  }
  return writer.take();
}

std::optional<Pulse> read_pulse(Bytes bytes) {
  CardReader reader(bytes, kPulseMagic);
  Pulse pulse;
  pulse.sender = reader.number<std::uint64_t>();
  pulse.number = reader.number<std::uint64_t>();
  const std::size_t count = reader.number<std::uint16_t>();
  reader.require(pulse.sender != 0 && pulse.number != 0 && count <= kMaxEchoes);
  for (std::size_t i = 0; i < count && reader.is_good(); ++i) {
    Echo& echo = pulse.echoes.emplace_back();
    echo.of = reader.number<std::uint64_t>();
    echo.number = reader.number<std::uint64_t>();
    echo.lay = reader.number<std::uint64_t>();
  }
  if (!reader.is_good()) return std::nullopt;
  return pulse;
}

Pulse RoundTrips::next(shm::Nanoseconds now) {
  const auto is_silent = [&](const Other& other) { return now - other.came >= kSilence; };
  std::erase_if(others_,
                [&](const auto& each) { return !each.second.is_there && is_silent(each.second); });
  Pulse pulse{me_, ++last_, {}};
  sent_.at(last_ % kKept) = now;
  for (const auto& [participant, other] : others_) {
    if (is_silent(other)) continue;
    pulse.echoes.push_back(
        {other.life, other.number, static_cast<std::uint64_t>(now - other.came)});
  }
  return pulse;
}

void RoundTrips::note(const Pulse& pulse, const Participant& from, shm::Nanoseconds now) {
  if (pulse.sender == me_) return;
  if (!others_.contains(from) && !make_place()) return;
  Other& other = others_[from];
  if (other.life == 0) {
    other.life = pulse.sender;
    other.echoed = last_;
  }
  if (pulse.sender != other.life || pulse.number <= other.number) return;
  other.number = pulse.number;
  other.came = now;
  other.came_at = last_;
  for (const Echo& echo : pulse.echoes) {
    if (echo.of != me_ || echo.number == 0 || echo.number > last_ || last_ - echo.number >= kKept) {
      continue;
    }
    other.echoed = std::max(other.echoed, echo.number);
    const shm::Nanoseconds passed = now - sent_.at(echo.number % kKept);
    // It cannot have lain there for longer than that.
    if (passed < 0 || echo.lay > static_cast<std::uint64_t>(passed)) continue;
    other.round_trip = passed - static_cast<shm::Nanoseconds>(echo.lay);
  }
}

bool RoundTrips::make_place() {
  if (others_.size() < kMaxEchoes) return true;
  return std::erase_if(others_, [&](const auto& each) { return !pulses(each.second); }) != 0;
}

void RoundTrips::keep(const std::set<Participant>& there) {
  std::erase_if(others_, [&](const auto& each) {
    return each.second.is_there && !there.contains(each.first);
  });
  for (auto& [participant, other] : others_) other.is_there = there.contains(participant);
}

std::set<Participant> RoundTrips::deaf() const {
  std::set<Participant> deaf;
  for (const auto& [participant, other] : others_) {
    if (last_ - other.echoed >= kUnechoed) deaf.insert(participant);
  }
  return deaf;
}

std::optional<std::set<Participant>> RoundTrips::pulsing() const {
  std::set<Participant> pulsing;
  for (const auto& [participant, other] : others_) {
    if (pulses(other)) pulsing.insert(participant);
  }
  if (pulsing.size() >= kMaxEchoes) return std::nullopt;
  return pulsing;
}

std::optional<shm::Nanoseconds> RoundTrips::of(const Participant& other) const {
  const auto found = others_.find(other);
  return found == others_.end() ? std::nullopt : found->second.round_trip;
}

}  // namespace arbiter::link
