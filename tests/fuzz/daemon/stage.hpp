// A daemon with two components that keep to the protocol, /low at one and /in at the other, and
// what must hold of them whatever others do.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "service/daemon.hpp"
#include "tests/fuzz/daemon/loop.hpp"
#include "tests/fuzz/daemon/peer.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::fuzz {

// Open descriptors of this process: the daemon's and our own.
std::size_t count_descriptors();

class Stage {
 public:
  Stage();

  [[nodiscard]] const std::string& path() const { return daemon_->path(); }
  // Lets the daemon do what there is to do, and the honest clients hear of it; then as much time
  // passes as it says, if anything waits for that.
  void run(shm::Nanoseconds time = 0);
  // Another model comes into force, within the time that the daemon grants to those who are slow.
  void reload();
  // The other of two that are loaded does, likewise; or one that was, if there was one.
  void switch_model();
  void roll_back();
  // A component comes, opens a port, closes it and goes.
  void serve_newcomer();
  // Once all hostile clients are gone: nothing of them is left.
  void require_as_before();

 private:
  void write_model(int number);
  void run_daemon();
  void require_status();
  // All sources that the daemon has to name: each costs two descriptors.
  std::size_t count_sources();

  test::TemporaryDirectory directory_;
  Loop loop_;
  Process owner_;
  std::unique_ptr<service::Daemon> daemon_;
  std::unique_ptr<Honest> sender_;
  std::unique_ptr<Honest> receiver_;
  std::unique_ptr<Honest> newcomer_;
  int model_ = 0;
  bool is_other_ = false;
  std::size_t descriptors_ = 0;
  std::size_t sources_ = 0;
};

}  // namespace arbiter::fuzz
