#include "bench/peers/iceoryx_roudi.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include <iceoryx_hoofs/log/logmanager.hpp>
#include <iceoryx_hoofs/posix_wrapper/file_lock.hpp>
#include <iceoryx_hoofs/posix_wrapper/posix_access_rights.hpp>
#include <iceoryx_posh/iceoryx_posh_types.hpp>
#include <iceoryx_posh/internal/roudi/roudi.hpp>
#include <iceoryx_posh/roudi/iceoryx_roudi_components.hpp>

namespace arbiter::bench {
namespace {

constexpr std::uint32_t kKiB = 1024;
constexpr std::uint64_t kNeeded = 200ull * kKiB * kKiB;

// What it would otherwise answer by ending the process.
void check_that_it_can_run() {
  using Lock = iox::posix::FileLock;
  const auto refused = [](const auto& error) {
    throw BenchError(error == iox::posix::FileLockError::LOCKED_BY_OTHER_PROCESS
                         ? "another RouDi runs on this machine; end it to measure iceoryx"
                         : "RouDi's lock file in /tmp cannot be had");
  };
  auto lock = Lock::create(iox::roudi::ROUDI_LOCK_NAME);
  if (lock.has_error()) refused(lock.get_error());
  struct statvfs shm {};
  if (::statvfs("/dev/shm", &shm) == 0 && std::uint64_t{shm.f_bavail} * shm.f_frsize < kNeeded) {
    throw BenchError("RouDi needs 200 MiB in /dev/shm (in a container: --shm-size)");
  }
}

// Whose name the shared memory bears.
std::string group() { return iox::posix::PosixGroup::getGroupOfCurrentProcess().getName().c_str(); }

iox::RouDiConfig_t memory() {
  iox::mepoo::MePooConfig pools;
  pools.addMemPool({128, 4096});
  pools.addMemPool({4 * kKiB, 256});
  pools.addMemPool({64 * kKiB, 64});
  pools.addMemPool({kKiB * kKiB, 16});
  pools.addMemPool({4 * kKiB * kKiB, 16});
  const iox::posix::PosixGroup::string_t name(iox::cxx::TruncateToCapacity, group());
  iox::RouDiConfig_t config;
  config.m_sharedMemorySegments.push_back({name, name, pools});
  return config;
}

// A runtime's socket and lock in /tmp are removed by what runs at exit, which a worker that was
// killed, or has done its work, does not.
void remove_traces(const std::string& prefix) {
  std::error_code ignored;
  for (const auto& file : std::filesystem::directory_iterator("/tmp", ignored)) {
    if (file.is_directory(ignored)) continue;
    if (!file.path().filename().string().starts_with(prefix)) continue;
    std::filesystem::remove(file.path(), ignored);
  }
}

// A worker that is killed in the middle of a publish leaves a mutex locked for ever, and RouDi may
// wait for it when it ends. Then what it would have removed is removed without it.
void bound_the_end(const std::string& prefix) {
  std::thread([prefix] {
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    ::shm_unlink("/iceoryx_mgmt");
    ::shm_unlink(("/" + group()).c_str());
    ::unlink("/tmp/roudi");
    ::unlink("/tmp/roudi.lock");
    ::unlink("/tmp/iox-unique-roudi.lock");
    remove_traces(prefix);
    ::_exit(1);
  }).detach();
}

// RouDi tells how it is doing whatever the log level. What can go wrong is checked before.
void be_silent() {
  const shm::FileDescriptor nowhere(::open("/dev/null", O_WRONLY | O_CLOEXEC));
  ::dup2(nowhere.get(), STDOUT_FILENO);
  ::dup2(nowhere.get(), STDERR_FILENO);
}

void run(Conversation& with, const std::string& prefix) {
  // However the benchmark ends, by Ctrl-C or killed, this process outlives it for as long as it
  // takes to clear /dev/shm and /tmp: the end of the conversation tells it.
  ::prctl(PR_SET_PDEATHSIG, 0);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) ::signal(number, SIG_IGN);
  be_silent();
  quieten_iceoryx();
  check_that_it_can_run();
  {
    using iox::roudi::RouDi;
    iox::roudi::IceOryxRouDiComponents components(memory());
    // No monitoring: it would throw out whom a debugger or SIGSTOP has stopped.
    RouDi roudi(components.rouDiMemoryManager, components.portManager,
                RouDi::RoudiStartupParameters(iox::roudi::MonitoringMode::OFF, false));
    with.say(1);
    std::uint64_t word = 0;
    while (with.hear_or_end(word)) {
    }
    bound_the_end(prefix);
  }
  remove_traces(prefix);
}

}  // namespace

std::shared_ptr<IceoryxRoudi> IceoryxRoudi::share() {
  static std::weak_ptr<IceoryxRoudi> current;
  if (auto running = current.lock()) return running;
  std::shared_ptr<IceoryxRoudi> started(new IceoryxRoudi);
  current = started;
  return started;
}

IceoryxRoudi::IceoryxRoudi()
    : worker_("RouDi", [prefix = "arbiter-bench-" + std::to_string(::getpid()) +
                                 "-"](Conversation& with) { run(with, prefix); }) {
  worker_.hear();
}

void quieten_iceoryx() {
  iox::log::LogManager::GetLogManager().SetDefaultLogLevel(iox::log::LogLevel::kError,
                                                           iox::log::LogLevelOutput::kHideLogLevel);
}

}  // namespace arbiter::bench
