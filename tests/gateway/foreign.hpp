// A middleware that a test plays itself.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/core/incoming.hpp"
#include "gateway/core/outgoing.hpp"

namespace arbiter::gateway {

// A sample of given bytes.
class BytesSample : public ForeignSample {
 public:
  explicit BytesSample(std::string bytes, std::size_t begin = 0, bool big_endian = false)
      : bytes_(std::move(bytes)), begin_(begin), big_endian_(big_endian) {}

  [[nodiscard]] std::size_t size() const noexcept override { return bytes_.size(); }
  [[nodiscard]] bool copy(std::size_t from, WritableBytes to) const noexcept override {
    if (is_broken) return false;
    std::memcpy(to.data(), bytes_.data() + from, to.size());
    ++copies;
    copied += to.size();
    return true;
  }
  [[nodiscard]] std::size_t data_begin() const noexcept override { return begin_; }
  [[nodiscard]] bool is_big_endian() const noexcept override { return big_endian_; }

  bool is_broken = false;
  mutable int copies = 0;
  mutable std::size_t copied = 0;

 private:
  const std::string bytes_;
  const std::size_t begin_;
  const bool big_endian_;
};

// What an entry with idle='zero' size='4' sends.
inline const std::string kZeros("\0\1\0\0\0\0\0\0", 8);

template <class Number>
std::string bytes_of(Number number) {
  std::string bytes(sizeof number, '\0');
  std::memcpy(bytes.data(), &number, sizeof number);
  return bytes;
}

// Keeps what is sent.
class KeepingSender : public Sender {
 public:
  [[nodiscard]] Result send(Bytes sample) noexcept override {
    Result result = answer;
    if (!answers.empty()) {
      result = answers.front();
      answers.erase(answers.begin());
    }
    if (result == Result::kSent) {
      sent.emplace_back(reinterpret_cast<const char*>(sample.data()), sample.size());
    }
    if (meanwhile) meanwhile();
    return result;
  }
  [[nodiscard]] Result send_at_once(Bytes sample) noexcept override {
    return would_wait ? Result::kBusy : send(sample);
  }
  [[nodiscard]] std::size_t largest_at_once() const noexcept override { return largest; }
  [[nodiscard]] WritableBytes draft(std::size_t bytes) noexcept override {
    if (!drafts) return {};
    room.assign(bytes, '\0');
    ++drafted;
    return {reinterpret_cast<std::byte*>(room.data()), bytes};
  }
  [[nodiscard]] Result send_draft() noexcept override {
    if (would_wait) return Result::kBusy;
    ++sent_drafts;
    return send_at_once({reinterpret_cast<const std::byte*>(room.data()), room.size()});
  }
  void drop_draft() noexcept override { ++dropped_drafts; }

  bool drafts = false;
  std::string room;  // the last draft
  int drafted = 0;
  int sent_drafts = 0;
  int dropped_drafts = 0;
  std::vector<std::string> sent;
  std::function<void()> meanwhile{};  // what happens while it sends
  bool would_wait = false;
  std::size_t largest = SIZE_MAX;
  Result answer = Result::kSent;
  std::vector<Result> answers;  // the next ones, before that
};

// All sources may have waited as long.
class OneAge : public AgesOfSources {
 public:
  [[nodiscard]] shm::Nanoseconds of(std::string_view) const override { return age; }
  shm::Nanoseconds age = 3'600'000'000'000;
};

}  // namespace arbiter::gateway
