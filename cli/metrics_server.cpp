#include "cli/metrics_server.hpp"

#include <microhttpd.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <map>
#include <string_view>
#include <utility>

#include <arbiter/arbiter.hpp>

#include "cli/listen.hpp"
#include "shm/clock.hpp"

namespace arbiter::cli {
namespace {

constexpr unsigned kMaxConnections = 64;
constexpr std::size_t kMaxRequestBytes = 16u << 10;
constexpr shm::Nanoseconds kMostTime = 5'000'000'000;
// Whoever asks more often is given the same document.
constexpr shm::Nanoseconds kFreshFor = 200'000'000;

using Response = std::unique_ptr<MHD_Response, decltype(&MHD_destroy_response)>;

Response make_response(const std::string& body, const char* type) {
  Response response(MHD_create_response_from_buffer(body.size(), const_cast<char*>(body.data()),
                                                    MHD_RESPMEM_MUST_COPY),
                    &MHD_destroy_response);
  if (response == nullptr) return response;
  MHD_add_response_header(response.get(), MHD_HTTP_HEADER_CONTENT_TYPE, type);
  MHD_add_response_header(response.get(), MHD_HTTP_HEADER_CONNECTION, "close");
  return response;
}

}  // namespace

class MetricsServer::Implementation {
 public:
  Implementation(const ListenAddress& address, std::function<std::string()> document)
      : document_(std::move(document)), listening_(listen_on(address.text, address.allow_remote)) {
    const std::array<MHD_OptionItem, 7> options{{
        {MHD_OPTION_LISTEN_SOCKET, listening_.socket.get(), nullptr},
        {MHD_OPTION_CONNECTION_LIMIT, kMaxConnections, nullptr},
        {MHD_OPTION_CONNECTION_MEMORY_LIMIT, static_cast<std::intptr_t>(kMaxRequestBytes), nullptr},
        {MHD_OPTION_STRICT_FOR_CLIENT, 1, nullptr},
        {MHD_OPTION_NOTIFY_CONNECTION, reinterpret_cast<std::intptr_t>(&note_connection), this},
        {MHD_OPTION_EXTERNAL_LOGGER, reinterpret_cast<std::intptr_t>(&say_nothing), nullptr},
        {MHD_OPTION_END, 0, nullptr},
    }};
    // Without a thread of its own.
    daemon_.reset(MHD_start_daemon(MHD_USE_EPOLL, 0, nullptr, nullptr, &answer, this,
                                   MHD_OPTION_ARRAY, options.data(), MHD_OPTION_END));
    if (daemon_ == nullptr) throw Error("cannot start the HTTP server");
    const auto* info = MHD_get_daemon_info(daemon_.get(), MHD_DAEMON_INFO_EPOLL_FD);
    if (info == nullptr) throw Error("cannot watch the HTTP server");
    epoll_ = info->epoll_fd;
  }
  ~Implementation() {
    daemon_.reset();  // closes the connections, which are noted here
    if (!listening_.path.empty()) ::unlink(listening_.path.c_str());
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  [[nodiscard]] const std::string& url() const { return listening_.url; }

  void run(const shm::FileDescriptor& interrupts) {
    for (;;) {
      pollfd ready[2]{{epoll_, POLLIN, 0}, {interrupts.get(), POLLIN, 0}};
      if (::poll(ready, 2, time_left()) < 0 && errno != EINTR) throw Error("cannot wait");
      if (ready[1].revents != 0) return;
      take_turns();
      if (hang_up_on_slow_ones()) take_turns();
    }
  }

 private:
  struct Stop {
    void operator()(MHD_Daemon* daemon) const { MHD_stop_daemon(daemon); }
  };

  // The library listens again at the turn after the one in which a place became free, and nothing
  // would wake us for that one.
  void take_turns() {
    std::uint64_t before = 0;
    do {
      before = closed_;
      MHD_run(daemon_.get());
    } while (closed_ != before);
  }

  static void say_nothing(void*, const char*, va_list) {}

  static void note_connection(void* self, MHD_Connection* connection, void**,
                              MHD_ConnectionNotificationCode code) {
    auto& server = *static_cast<Implementation*>(self);
    if (code == MHD_CONNECTION_NOTIFY_CLOSED) {
      server.ends_.erase(connection);
      ++server.closed_;
    } else {
      server.ends_[connection] = shm::monotonic_now() + kMostTime;
    }
  }

  static MHD_Result answer(void* self, MHD_Connection* connection, const char* url,
                           const char* method, const char*, const char*, std::size_t*, void**) {
    return static_cast<Implementation*>(self)->answer(connection, url, method);
  }

  // Called once the head of a request is whole. What a body would say does not matter.
  MHD_Result answer(MHD_Connection* connection, std::string_view url, std::string_view method) {
    if (method != MHD_HTTP_METHOD_GET && method != MHD_HTTP_METHOD_HEAD) {
      return refuse(connection, MHD_HTTP_METHOD_NOT_ALLOWED, "only GET and HEAD are served\n");
    }
    if (url != "/metrics") {
      return refuse(connection, MHD_HTTP_NOT_FOUND, "the metrics are at /metrics\n");
    }
    const shm::Nanoseconds now = shm::monotonic_now();
    if (fresh_ == nullptr || now >= fresh_until_) {
      // Whoever still reads the one before has it for as long.
      fresh_ = make_response(document_(), "text/plain; version=0.0.4; charset=utf-8");
      fresh_until_ = shm::monotonic_now() + kFreshFor;
    }
    if (fresh_ == nullptr) return MHD_NO;
    return MHD_queue_response(connection, MHD_HTTP_OK, fresh_.get());
  }

  static MHD_Result refuse(MHD_Connection* connection, unsigned code, const std::string& text) {
    const Response response = make_response(text, "text/plain; charset=utf-8");
    if (response == nullptr) return MHD_NO;
    return MHD_queue_response(connection, code, response.get());
  }

  // Milliseconds until something must be done; -1: nothing is to be.
  [[nodiscard]] int time_left() const {
    constexpr shm::Nanoseconds kMillisecond = 1'000'000;
    shm::Nanoseconds end = shm::kForever;
    for (const auto& [connection, time] : ends_) end = std::min(end, time);
    MHD_UNSIGNED_LONG_LONG own = 0;
    const shm::Nanoseconds now = shm::monotonic_now();
    if (MHD_get_timeout(daemon_.get(), &own) == MHD_YES) {
      end =
          std::min(end, now + static_cast<shm::Nanoseconds>(std::min(own, 1000ull)) * kMillisecond);
    }
    if (end == shm::kForever) return -1;
    return static_cast<int>(std::max<shm::Nanoseconds>(end - now + kMillisecond - 1, 0) /
                            kMillisecond);
  }

  // The library sees the end at its next turn, closes the connection and says so. False: there was
  // none.
  bool hang_up_on_slow_ones() {
    const shm::Nanoseconds now = shm::monotonic_now();
    bool any = false;
    for (auto& [connection, end] : ends_) {
      if (now < end) continue;
      const auto* info = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
      if (info != nullptr) ::shutdown(info->connect_fd, SHUT_RDWR);
      end = now + kMostTime;
      any = true;
    }
    return any;
  }

  const std::function<std::string()> document_;
  Listening listening_;
  std::map<MHD_Connection*, shm::Nanoseconds> ends_;  // when each has had its time
  std::uint64_t closed_ = 0;                          // connections, so far
  Response fresh_{nullptr, &MHD_destroy_response};
  shm::Nanoseconds fresh_until_ = 0;
  int epoll_ = -1;
  std::unique_ptr<MHD_Daemon, Stop> daemon_;
};

MetricsServer::MetricsServer(const ListenAddress& address, std::function<std::string()> document)
    : implementation_(std::make_unique<Implementation>(address, std::move(document))) {}
MetricsServer::~MetricsServer() = default;

const std::string& MetricsServer::url() const noexcept { return implementation_->url(); }
void MetricsServer::run(const shm::FileDescriptor& interrupts) { implementation_->run(interrupts); }

}  // namespace arbiter::cli
