#include "bench/peers/relay.hpp"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <lua.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>

#include "bench/harness/cpu.hpp"

namespace arbiter::bench {
namespace {

class Rules {
 public:
  // A rule becomes a function once; what is left for each sample is to call it.
  int compile(const std::string& rule) {
    if (luaL_loadstring(lua_.get(), ("return " + rule).c_str()) != LUA_OK) fail();
    return luaL_ref(lua_.get(), LUA_REGISTRYINDEX);
  }
  void set(const std::string& name, bool value) {
    lua_pushboolean(lua_.get(), value ? 1 : 0);
    lua_setglobal(lua_.get(), name.c_str());
  }
  bool holds(int rule) {
    lua_rawgeti(lua_.get(), LUA_REGISTRYINDEX, rule);
    if (lua_pcall(lua_.get(), 0, 1, 0) != LUA_OK) fail();
    const bool result = lua_toboolean(lua_.get(), -1) != 0;
    lua_pop(lua_.get(), 1);
    return result;
  }

 private:
  struct Close {
    void operator()(lua_State* lua) const { lua_close(lua); }
  };

  [[noreturn]] void fail() { throw BenchError(lua_tostring(lua_.get(), -1)); }

  std::unique_ptr<lua_State, Close> lua_{luaL_newstate()};
};

// What the relay knows, and decides by. One thread would do without the mutex; but the nodes that
// this stands for are called back by several.
class Coordinator {
 public:
  Coordinator(const std::vector<Relay::Source>& sources, const RelayOptions& options)
      : timeout_ns_(options.timeout_ns) {
    for (const auto& each : sources) {
      last_heard_[each.name];
      rules_of_.push_back(each.rule.empty() ? std::nullopt
                                            : std::optional(rules_.compile(each.rule)));
    }
  }

  bool may_pass(std::size_t source, const std::string& name, std::int64_t now) {
    const std::lock_guard lock(mutex_);
    last_heard_[name] = now;
    return holds(source, now);
  }
  void forget(const std::string& name) {
    const std::lock_guard lock(mutex_);
    last_heard_[name].reset();
  }
  bool is_selected(std::size_t source, const std::string& name, std::int64_t now) {
    const std::lock_guard lock(mutex_);
    return is_active(last_heard_[name], now) && holds(source, now);
  }

 private:
  using LastHeard = std::optional<std::int64_t>;

  [[nodiscard]] bool is_active(const LastHeard& last, std::int64_t now) const {
    return last && now - *last < timeout_ns_;
  }
  bool holds(std::size_t source, std::int64_t now) {
    if (!rules_of_[source]) return false;
    for (const auto& [each, last] : last_heard_) rules_.set(each, is_active(last, now));
    return rules_.holds(*rules_of_[source]);
  }

  std::int64_t timeout_ns_;
  std::mutex mutex_;
  std::map<std::string, LastHeard> last_heard_;
  Rules rules_;
  std::vector<std::optional<int>> rules_of_;
};

}  // namespace

DatagramPair::DatagramPair(std::size_t bytes) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0, ends) != 0) {
    throw std::system_error(errno, std::generic_category(), "socketpair");
  }
  write = shm::FileDescriptor(ends[0]);
  read = shm::FileDescriptor(ends[1]);
  const int size = static_cast<int>(2 * bytes + 4096);
  if (bytes > 4096) ::setsockopt(write.get(), SOL_SOCKET, SO_SNDBUF, &size, sizeof size);
}

Relay::Relay(std::vector<Source> sources, std::size_t destinations, const RelayOptions& options)
    : sources_(std::move(sources)), options_(options) {
  for (std::size_t i = 0; i < sources_.size(); ++i) in_.emplace_back(options.bytes);
  for (std::size_t i = 0; i < destinations; ++i) out_.emplace_back(options.bytes);
  worker_ = Worker("relay", [this](Conversation& with) {
    // Ends with the process.
    std::thread([this, &with] {
      try {
        run();
      } catch (const std::exception& error) {
        with.fail(error.what());
      }
    }).detach();
    with.say(1);
    std::uint64_t word = 0;
    while (with.hear_or_end(word)) {
    }
  });
  worker_.hear();
}

void Relay::run() {
  Coordinator coordinator(sources_, options_);
  std::vector<std::byte> buffer(options_.bytes);
  std::vector<pollfd> polled;
  for (const DatagramPair& each : in_) polled.push_back({each.read.get(), POLLIN, 0});
  // When a destination's commander will be silent, if it has one.
  std::vector<std::optional<std::int64_t>> falls_silent(out_.size());

  const auto tell_idle = [&](std::int64_t now) {
    for (std::size_t to = 0; to < out_.size(); ++to) {
      if (!falls_silent[to] || now < *falls_silent[to]) continue;
      falls_silent[to].reset();
      bool is_commanded = false;
      for (std::size_t i = 0; i < sources_.size(); ++i) {
        if (sources_[i].destination != to) continue;
        is_commanded = is_commanded || coordinator.is_selected(i, sources_[i].name, now);
      }
      if (!is_commanded) ::send(out_[to].write.get(), buffer.data(), 0, MSG_DONTWAIT);
    }
  };
  const auto wait = [&] {
    std::optional<std::int64_t> first;
    for (const auto& each : falls_silent) {
      if (each && (!first || *each < *first)) first = each;
    }
    if (!first || !options_.tells_idle)
      return ::ppoll(polled.data(), polled.size(), nullptr, nullptr);
    const std::int64_t left = std::max<std::int64_t>(*first - now_ns(), 0);
    const timespec timeout{left / 1'000'000'000, left % 1'000'000'000};
    return ::ppoll(polled.data(), polled.size(), &timeout, nullptr);
  };

  for (;;) {
    if (wait() < 0 && errno != EINTR) return;
    for (std::size_t i = 0; i < polled.size(); ++i) {
      if ((polled[i].revents & POLLIN) == 0) continue;
      const ssize_t size = ::recv(polled[i].fd, buffer.data(), buffer.size(), MSG_DONTWAIT);
      const Source& source = sources_[i];
      if (size == 0) coordinator.forget(source.name);
      if (size <= 0) continue;
      const std::int64_t now = now_ns();
      if (!coordinator.may_pass(i, source.name, now)) continue;
      // Where the destination does not keep up, the relay waits, as over a stream: a datagram that
      // is dropped in its place might be the override's only one.
      ::send(out_[source.destination].write.get(), buffer.data(), static_cast<std::size_t>(size),
             MSG_NOSIGNAL);
      falls_silent[source.destination] = now + options_.timeout_ns;
    }
    if (options_.tells_idle) tell_idle(now_ns());
  }
}

std::string none_of(const std::vector<std::string>& names) {
  std::string rule;
  for (const std::string& each : names) rule += (rule.empty() ? "not " : " and not ") + each;
  return rule;
}

}  // namespace arbiter::bench
