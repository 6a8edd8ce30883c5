// `arbiter record` beside a test.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <signal.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "evidence/record_reader.hpp"
#include "tests/cli/arbiter_program.hpp"
#include "tests/support/await.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {

// Nothing ends by itself while a test waits.
inline const std::string kLasting = R"(<behaviors timeout="1000s">
  <behavior name="Low"><config at="/p">/low</config></behavior>
  <behavior name="High"><config at="/p">/high</config><inhibition>Low</inhibition></behavior>
</behaviors>
)";

// The recordings in it.
inline std::vector<std::string> files_in(const std::string& directory) {
  std::vector<std::string> files;
  for (const auto& each : std::filesystem::directory_iterator(directory)) {
    if (each.path().extension() == ".mcap") files.push_back(each.path().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

class Recording {
 public:
  // Returns once all sources are tapped.
  explicit Recording(const Daemon& daemon, std::vector<std::string> more = {})
      : file_(daemon.directory() + "/recording.mcap"),
        out_(daemon.directory() + "/record.out"),
        err_(daemon.directory() + "/record.err") {
    const auto open = [](const std::string& path) {
      return shm::FileDescriptor(
          ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
    };
    const auto out = open(out_);
    const auto err = open(err_);
    more.insert(more.begin(), {std::string(ARBITER_PROGRAMS) + "/arbiter", "record", "-o", file_});
    process_ = ChildProcess(more, {}, {-1, out.get(), err.get()});
    see("arbiter: recording ");
  }
  // Returns once it has said so on standard error.
  void see(const std::string& text) const {
    pollfd ended{process_.descriptor(), POLLIN, 0};
    while (error().find(text) == std::string::npos) {
      if (::poll(&ended, 1, 1) != 1 || error().find(text) != std::string::npos) continue;
      throw std::runtime_error("it has ended: " + error());
    }
  }
  // Returns its exit code.
  int end(int signal = SIGINT) {
    process_.signal(signal);
    return process_.wait();
  }
  [[nodiscard]] ChildProcess& process() { return process_; }
  [[nodiscard]] std::string error() const { return content_of(err_); }
  [[nodiscard]] std::string output() const { return content_of(out_); }
  [[nodiscard]] const std::string& file() const { return file_; }

  // Of what has been written by now. With payloads.
  template <class Kind>
  [[nodiscard]] std::vector<Kind> records() const {
    std::vector<Kind> all;
    evidence::read_recording(file_, evidence::Payloads::read, [&](evidence::Record&& record) {
      if (auto* one = std::get_if<Kind>(&record)) all.push_back(std::move(*one));
    });
    return all;
  }
  // Returns once a record is in the file for which this is true.
  template <class Kind, class Is>
  void wait_for(const Is& is) const {
    await(
        [&] {
          const std::vector<Kind> all = records<Kind>();
          return std::any_of(all.begin(), all.end(), is);
        },
        20);  // it reads the whole file
  }
  // `arbiter simulate --recording`.
  [[nodiscard]] nlohmann::json simulate(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"simulate", "--json", "--recording", file_});
    return nlohmann::json::parse(arbiter(more).out);
  }

 private:
  const std::string file_;
  const std::string out_;
  const std::string err_;
  ChildProcess process_;
};

}  // namespace arbiter::test
