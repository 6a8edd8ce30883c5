// What the registry says of one name: whose it is, which pages it has, who has it open.
//
// The daemon writes; it may be killed between any two stores, or stopped while its successor reads.
// Each group of words has one that makes it count: it is cleared before the others change and
// stored after them, never twice with the same value. A reader that finds it unchanged behind the
// others has read what belongs together.
//
// Thread safety: one writer, the daemon; its successor reads.
#pragma once

#include <sys/types.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include "service/kept/process.hpp"
#include "shm/activity_pages.hpp"
#include "shm/atomic.hpp"
#include "shm/ids.hpp"
#include "shm/limits.hpp"

namespace arbiter::service {

// A component's conversation with the daemon, and those that carry it on after a loss. Never given
// twice.
using NodeId = std::uint64_t;

// Who has a port open.
struct Owner {
  shm::PortInstance port = 0;  // 0: nobody
  NodeId node = 0;
  Process process;
};

// Who can write an activity page: whoever has ever been given it. Nobody: only the daemon can.
using PageUser = std::optional<uid_t>;

class RegistryEntry {
 public:
  // The name of the entry; empty: none that counts. SYNC POINT: name-registered. The acquire pairs
  // with the release in name(): who sees that a name counts sees all of it. The acquire fence pairs
  // with the release fence there: who has seen a part of another name sees that the first one has
  // ceased to count.
  [[nodiscard]] std::string name() const {
    const std::uint32_t named = named_.load(std::memory_order_acquire);
    if (named == 0) return {};
    std::array<char, kNameBytes> bytes;
    for (std::size_t i = 0; i < kNameWords; ++i) {
      const std::uint64_t word = name_[i].load(std::memory_order_relaxed);
      std::memcpy(bytes.data() + i * sizeof word, &word, sizeof word);
    }
    shm::acquire_fence();
    if (named_.load(std::memory_order_relaxed) != named) return {};
    return {bytes.data(), strnlen(bytes.data(), shm::kMaxNameLength)};
  }

  // SYNC POINT: name-registered. A release store alone would not keep what follows behind it: the
  // fence does.
  void name(std::string_view name) noexcept {
    clear_owner();
    named_.store(0, std::memory_order_relaxed);
    shm::release_fence();
    const std::size_t length = std::min<std::size_t>(name.size(), shm::kMaxNameLength);
    for (std::size_t i = 0; i < kNameWords; ++i) {
      std::uint64_t word = 0;
      const std::size_t at = i * sizeof word;
      if (at < length) std::memcpy(&word, name.data() + at, std::min(sizeof word, length - at));
      name_[i].store(word, std::memory_order_relaxed);
    }
    const std::uint32_t naming = namings_.load(std::memory_order_relaxed) + 1;
    namings_.store(naming, std::memory_order_relaxed);
    named_.store(naming, std::memory_order_release);
  }
  void forget() noexcept {
    clear_owner();
    named_.store(0, std::memory_order_relaxed);
  }

  // SYNC POINT: owner-registered. As the name: the port makes the owner count, and is never given
  // twice.
  [[nodiscard]] Owner owner() const noexcept {
    Owner result;
    result.port = port_.load(std::memory_order_acquire);
    result.node = node_.load(std::memory_order_relaxed);
    result.process.pid = static_cast<pid_t>(pid_.load(std::memory_order_relaxed));
    result.process.started = started_.load(std::memory_order_relaxed);
    shm::acquire_fence();
    const bool counts = result.port != 0 && port_.load(std::memory_order_relaxed) == result.port;
    return counts ? result : Owner{};
  }
  void set_owner(const Owner& owner) noexcept {
    clear_owner();
    shm::release_fence();  // SYNC POINT: owner-registered
    node_.store(owner.node, std::memory_order_relaxed);
    pid_.store(static_cast<std::uint64_t>(owner.process.pid), std::memory_order_relaxed);
    started_.store(owner.process.started, std::memory_order_relaxed);
    port_.store(owner.port, std::memory_order_release);  // SYNC POINT: owner-registered
  }
  void clear_owner() noexcept { port_.store(0, std::memory_order_relaxed); }

  // Of a source: its page of that number, which counts once the board says so
  // (TableWriter::change_page, whose release comes behind these).
  void set_page(shm::PageNumber number, ino_t inode, PageUser user) noexcept {
    pages_[number % 2].inode.store(inode, std::memory_order_relaxed);
    set_page_user(number, user);
  }
  void set_page_user(shm::PageNumber number, PageUser user) noexcept {
    pages_[number % 2].user.store(user ? std::uint64_t{*user} + 1 : 0, std::memory_order_relaxed);
  }
  [[nodiscard]] ino_t page_inode(shm::PageNumber number) const noexcept {
    return pages_[number % 2].inode.load(std::memory_order_relaxed);
  }
  [[nodiscard]] PageUser page_user(shm::PageNumber number) const noexcept {
    const std::uint64_t user = pages_[number % 2].user.load(std::memory_order_relaxed);
    if (user == 0) return {};
    return static_cast<uid_t>(user - 1);
  }

 private:
  static constexpr std::size_t kNameBytes = shm::kMaxNameLength + 1;
  static constexpr std::size_t kNameWords = kNameBytes / sizeof(std::uint64_t);
  static_assert(kNameWords * sizeof(std::uint64_t) == kNameBytes);

  struct Page {
    shm::Atomic<std::uint64_t> inode;
    shm::Atomic<std::uint64_t> user;  // and one; 0: nobody
  };

  std::array<Page, 2> pages_;
  shm::Atomic<std::uint64_t> port_;  // not 0: the owner counts
  shm::Atomic<std::uint64_t> node_;
  shm::Atomic<std::uint64_t> pid_;
  shm::Atomic<std::uint64_t> started_;
  shm::Atomic<std::uint32_t> named_;    // not 0: the name counts
  shm::Atomic<std::uint32_t> namings_;  // how often it has got one
  std::array<shm::Atomic<std::uint64_t>, kNameWords> name_;
};

}  // namespace arbiter::service
