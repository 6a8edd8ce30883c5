// arbiter metrics: what it writes, what it serves over HTTP, and to clients that mean no good.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/cli/why_program.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/prometheus.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

const std::string kGet = "GET /metrics HTTP/1.1\r\nHost: robot\r\n\r\n";

// A server, and connections to it.
class Served {
 public:
  explicit Served(const std::string& directory, std::string address = "127.0.0.1:0",
                  const std::string& instance = {})
      : err_(directory + "/metrics.err") {
    const shm::FileDescriptor err(
        ::open(err_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
    std::vector<std::string> argv{std::string(ARBITER_PROGRAMS) + "/arbiter", "metrics", "--listen",
                                  std::move(address)};
    if (!instance.empty()) argv.insert(argv.end(), {"--instance", instance});
    process_ = ChildProcess(argv, {}, {-1, -1, err.get()});
    pollfd ended{process_.descriptor(), POLLIN, 0};
    while (error().find("/metrics\n") == std::string::npos) {
      if (::poll(&ended, 1, 1) == 1) throw std::runtime_error("it has ended: " + error());
    }
  }

  [[nodiscard]] std::string error() const { return content_of(err_); }
  ChildProcess& process() { return process_; }
  [[nodiscard]] std::size_t descriptors() const {
    const std::filesystem::directory_iterator open("/proc/" + std::to_string(process_.pid()) +
                                                   "/fd");
    return static_cast<std::size_t>(std::distance(begin(open), end(open)));
  }

  [[nodiscard]] shm::FileDescriptor connect() const {
    const std::string text = error();
    const auto colon = text.find(':', text.find("http://127.0.0.1") + 7);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(std::stoi(text.substr(colon + 1))));
    shm::FileDescriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (::connect(socket.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
      throw std::runtime_error("connect");
    }
    return socket;
  }
  // All that comes until it hangs up.
  [[nodiscard]] std::string ask(const std::string& request) const {
    return exchange(connect(), request);
  }
  static std::string exchange(const shm::FileDescriptor& socket, std::string_view request) {
    while (!request.empty()) {
      const ssize_t count = ::send(socket.get(), request.data(), request.size(), MSG_NOSIGNAL);
      if (count < 0) break;
      request.remove_prefix(static_cast<std::size_t>(count));
    }
    std::string answer;
    char bytes[4096];
    for (ssize_t count = 0; (count = ::recv(socket.get(), bytes, sizeof bytes, 0)) > 0;) {
      answer.append(bytes, static_cast<std::size_t>(count));
    }
    return answer;
  }

 private:
  const std::string err_;
  ChildProcess process_;
};

std::map<std::string, Metric> metrics_in(const std::string& answer) {
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200 OK\r\n"));
  EXPECT_THAT(answer, HasSubstr("Content-Type: text/plain; version=0.0.4; charset=utf-8\r\n"));
  const auto body = answer.find("\r\n\r\n");
  return body == std::string::npos ? std::map<std::string, Metric>()
                                   : read_metrics(answer.substr(body + 4));
}

TEST(MetricsProgram, WritesWhatHappens) {
  Daemon daemon(kGazeModel);
  Node node("test");
  auto face = node.output_port<int>("/face");
  auto gaze = node.input_port<int>("/gaze");
  for (int i = 0; i < 3; ++i) face.publish(i);
  ASSERT_TRUE(gaze.take());
  ProgramResult result;
  do {  // it gives the daemon one second
    result = arbiter({"metrics"});
  } while (result.err.find("did not answer within") != std::string::npos);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  auto metrics = read_metrics(result.out);
  EXPECT_EQ(metrics["arbiter_up"].samples[{}], 1);
  const MetricLabels source{{"source", "/face"}};
  EXPECT_EQ(metrics["arbiter_source_samples_published_total"].samples[source], 3);
  EXPECT_EQ(metrics["arbiter_port_samples_taken_total"].samples[(MetricLabels{{"port", "/gaze"}})],
            1);
  const MetricLabels connection{{"port", "/gaze"}, {"source", "/face"}};
  EXPECT_EQ(metrics["arbiter_connection_winner"].samples[connection], 1);
}

TEST(MetricsProgram, SaysThatThereIsNoDaemon) {
  const auto result = arbiter({"metrics", "--instance", "nobody-has-this-instance"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(read_metrics(result.out).at("arbiter_up").samples.at({}), 0);
  EXPECT_THAT(result.err, HasSubstr("no arbiterd of instance"));
}

TEST(MetricsProgram, GivesADaemonThatDoesNotAnswerOneSecond) {
  Daemon daemon(kGazeModel);
  daemon.process().stop();
  const auto result = arbiter({"metrics"});
  daemon.process().signal(SIGCONT);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(read_metrics(result.out).at("arbiter_up").samples.at({}), 0);
  const std::string within = "did not answer within ";
  const auto at = result.err.find(within);
  ASSERT_NE(at, std::string::npos) << result.err;
  EXPECT_LT(std::stoi(result.err.substr(at + within.size())), 5000) << "a second, and not five";
}

TEST(MetricsServer, FollowsTheDaemonsThatComeAndGo) {
  Daemon daemon(kGazeModel);
  Served served(daemon.directory());
  const auto is_up = [&] { return metrics_in(served.ask(kGet))["arbiter_up"].samples[{}]; };
  await([&] { return is_up() == 1; });
  daemon.kill();
  await([&] { return is_up() == 0; });
  EXPECT_THAT(served.error(), HasSubstr("no arbiterd of instance"));
  daemon.restart();
  await([&] { return is_up() == 1; });
  EXPECT_THAT(served.error(), testing::EndsWith("\narbiter: the daemon answers again\n"));
  served.process().signal(SIGTERM);
  EXPECT_EQ(served.process().wait(), 0);
}

TEST(MetricsServer, RemovesItsSocketAtAHangup) {
  ::signal(SIGHUP, SIG_DFL);  // what a test was started with, the program has too
  const TemporaryDirectory directory;
  const std::string socket = directory.file("metrics.sock");
  Served served(directory.path(), socket);
  EXPECT_TRUE(std::filesystem::exists(socket));
  served.process().signal(SIGHUP);
  EXPECT_EQ(served.process().wait(), 0);
  EXPECT_FALSE(std::filesystem::exists(socket));
}

TEST(MetricsServer, AnswersWhatItDoesNotServe) {
  const TemporaryDirectory directory;
  const Served served(directory.path(), "127.0.0.1:0", "nobody-has-this-instance");
  EXPECT_THAT(served.ask("GET / HTTP/1.1\r\nHost: x\r\n\r\n"), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(served.ask("POST /metrics HTTP/1.1\r\nHost: x\r\nContent-Length: 0\r\n\r\n"),
              StartsWith("HTTP/1.1 405 "));
  const std::string head = served.ask("HEAD /metrics HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_THAT(head, StartsWith("HTTP/1.1 200 "));
  EXPECT_TRUE(head.ends_with("\r\n\r\n"));
}

TEST(MetricsServer, SurvivesRequestsThatAreNone) {
  const TemporaryDirectory directory;
  const Served served(directory.path(), "127.0.0.1:0", "nobody-has-this-instance");
  EXPECT_EQ(metrics_in(served.ask(kGet))["arbiter_up"].samples[{}], 0);
  const auto before = served.descriptors();
  const std::string large(1u << 20, 'x');
  for (const std::string& request :
       {"GET /" + large, "GET /metrics HTTP/1.1\r\nHost: " + large, large + "\r\n\r\n",
        "GET /metrics HTTP/1.1\r\n" + large, std::string(4096, '\0') + "\r\n\r\n",
        std::string("GET /metrics HTTP/9.9\r\n\r\n"), std::string("\r\n\r\n\r\n x\r\n\r\n"),
        "POST /metrics HTTP/1.1\r\nHost: x\r\nContent-Length: 99999999999999999999\r\n\r\n" + large,
        "POST /metrics HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\nffffffff\r\n" +
            large,
        kGet + kGet + kGet + large}) {
    const std::string answer = served.ask(request);
    EXPECT_LT(answer.size(), 16384u) << request.substr(0, 60);
  }
  EXPECT_EQ(metrics_in(served.ask(kGet))["arbiter_up"].samples[{}], 0);
  await([&] { return served.descriptors() <= before; });
}

// Sixty-four who say nothing, or a byte now and then, have all places; one who asks comes after.
TEST(MetricsServer, HangsUpOnThoseWhoTakeTooLong) {
  const TemporaryDirectory directory;
  const Served served(directory.path(), "127.0.0.1:0", "nobody-has-this-instance");
  std::vector<shm::FileDescriptor> slow;
  for (int i = 0; i < 64; ++i) {
    slow.push_back(served.connect());
    EXPECT_EQ(
        ::send(slow.back().get(), kGet.data(), static_cast<std::size_t>(i % 20), MSG_NOSIGNAL),
        i % 20);
  }
  std::thread dripping([&] {  // until it is hung up on
    while (::send(slow.back().get(), "G", 1, MSG_NOSIGNAL) == 1) ::usleep(100'000);
  });
  EXPECT_EQ(metrics_in(served.ask(kGet))["arbiter_up"].samples[{}], 0);
  dripping.join();
  for (const auto& socket : slow) Served::exchange(socket, "");
}

// Whose answers nobody reads.
TEST(MetricsServer, ServesBesideThoseWhoDoNotRead) {
  const TemporaryDirectory directory;
  const Served served(directory.path(), "127.0.0.1:0", "nobody-has-this-instance");
  std::vector<shm::FileDescriptor> deaf;
  for (int i = 0; i < 300; ++i) {
    deaf.push_back(served.connect());
    ::send(deaf.back().get(), kGet.data(), kGet.size(), MSG_NOSIGNAL);
  }
  EXPECT_EQ(metrics_in(served.ask(kGet))["arbiter_up"].samples[{}], 0);
}

TEST(MetricsServer, IsReachedByAPathOfItsOwnersOnly) {
  const TemporaryDirectory directory;
  const std::string path = directory.path() + "/socket";
  const auto ask = [&] {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    const shm::FileDescriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
    EXPECT_EQ(::connect(socket.get(), reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    return Served::exchange(socket, kGet);
  };
  {
    Served served(directory.path(), path, "nobody-has-this-instance");
    EXPECT_EQ(metrics_in(ask())["arbiter_up"].samples[{}], 0);
    struct stat status {};
    ASSERT_EQ(::stat(path.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0600u);
    const auto second = arbiter({"metrics", "--listen", path});
    EXPECT_EQ(second.exit_code, 1);
    EXPECT_THAT(second.err, HasSubstr("in use"));
    served.process().kill();
  }
  EXPECT_TRUE(std::filesystem::exists(path)) << "left behind by one that was killed";
  {
    Served served(directory.path(), path, "nobody-has-this-instance");
    EXPECT_EQ(metrics_in(ask())["arbiter_up"].samples[{}], 0);
    served.process().signal(SIGINT);
    EXPECT_EQ(served.process().wait(), 0);
  }
  EXPECT_FALSE(std::filesystem::exists(path));
  directory.write("socket", "precious");
  EXPECT_EQ(arbiter({"metrics", "--listen", path}).exit_code, 1);
  EXPECT_EQ(content_of(path), "precious");
}

// In the directory where it is started: no slash is needed.
TEST(MetricsServer, TakesANameThatEndsInSockForAPath) {
  const TemporaryDirectory directory;
  const ChildProcess served(
      {"/bin/sh", "-c",
       "cd " + directory.path() + " && exec " ARBITER_PROGRAMS "/arbiter metrics --listen m.sock"},
      {}, {});
  while (!std::filesystem::is_socket(directory.path() + "/m.sock")) std::this_thread::yield();
}

TEST(MetricsServer, ListensNowhereElseUnlessItMay) {
  for (const char* address : {"0.0.0.0:0", "[::]:0", "192.0.2.1:9180"}) {
    const auto result = arbiter({"metrics", "--listen", address});
    EXPECT_EQ(result.exit_code, 1) << address;
    EXPECT_THAT(result.err, HasSubstr("other machines could reach it")) << address;
  }
  for (const char* address : {"9180", "robot:9180", "127.0.0.1:http", "127.0.0.1:", ":9180",
                              "::1:9180", "127.0.0.1:99999"}) {
    const auto result = arbiter({"metrics", "--listen", address});
    EXPECT_EQ(result.exit_code, 2) << address;
    EXPECT_THAT(result.err, HasSubstr("write ADDRESS:PORT")) << address;
  }
  EXPECT_EQ(arbiter({"metrics", "--allow-remote"}).exit_code, 2);
  const TemporaryDirectory directory;
  Served served(directory.path(), "localhost:0", "nobody-has-this-instance");
  EXPECT_EQ(metrics_in(served.ask(kGet))["arbiter_up"].samples[{}], 0);
}

}  // namespace
}  // namespace arbiter::test
