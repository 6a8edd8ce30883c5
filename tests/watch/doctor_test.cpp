// What the doctor finds on machines, of hosts and in a status that a test has made up.
#include "watch/doctor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/page_tables.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/support/text_files.hpp"
#include "tests/watch/codes_of.hpp"
#include "tests/wire/full_status.hpp"

namespace arbiter::test {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using watch::Findings;

std::string limits(const std::string& locked, const std::string& files,
                   const std::string& priority) {
  return "Limit                     Soft Limit           Hard Limit           Units     \n"
         "Max open files            " +
         files +
         "                524288               files     \n"
         "Max locked memory         " +
         locked +
         "              unlimited            bytes     \n"
         "Max realtime priority     " +
         priority + "                    99                   \n";
}

// A machine where nothing is wrong, to begin with.
class MadeUpMachine {
 public:
  MadeUpMachine() {
    set("proc/self/limits", limits("unlimited", "65536", "80"));
    set("proc/self/status", "Name:\tarbiter\nCapEff:\t0000000000000000\n");
    set("proc/meminfo", "MemTotal:        8000000 kB\nMemAvailable:    4000000 kB\n");
    set(kClock + "current_clocksource", "tsc\n");
    set(kClock + "available_clocksource", "tsc hpet acpi_pm \n");
    for (const std::string cpu : {"cpu0", "cpu1"}) set_governor(cpu, "performance");
    set("sys/devices/system/cpu/online", "0-1\n");
  }

  void set(const std::string& path, const std::string& content) const {
    fs::create_directories((fs::path(directory_.path()) / path).parent_path());
    directory_.write(path, content);
  }
  void set_link(const std::string& path, const std::string& target) const {
    const auto whole = fs::path(directory_.path()) / path;
    fs::create_directories(whole.parent_path());
    fs::create_symlink(target, whole);
  }
  void set_governor(const std::string& cpu, const std::string& governor) const {
    set("sys/devices/system/cpu/" + cpu + "/cpufreq/scaling_governor", governor + "\n");
  }
  [[nodiscard]] watch::Machine machine() const { return watch::Machine(directory_.path()); }
  [[nodiscard]] Findings findings() const { return watch::examine_machine(machine()); }

  const std::string kClock = "sys/devices/system/clocksource/clocksource0/";

 private:
  const TemporaryDirectory directory_;
};

TEST(Doctor, HasAllOfItsCodesOnThePage) {
  std::vector<std::string> codes;
  for (const PageRow& row :
       rows_of(content_of(ARBITER_SOURCE "/docs/watching.md"), {"code", "found if"})) {
    codes.push_back(quoted(row.cells.at(0)).at(0));
  }
  EXPECT_EQ(codes, watch::finding_codes());
}

TEST(Doctor, FindsWhatHostsDoNotAgreeUpon) {
  wire::HostsDocument hosts;
  EXPECT_THAT(codes_of(watch::examine_hosts(hosts)), IsEmpty());
  hosts.waits_for = "there is no interface eth7";
  using enum wire::DisagreementKind;
  for (const auto kind : {kInputPort, kSource, kHostName, kModel}) {
    hosts.disagreements.push_back({kind, "/Motor/speed:i", {"base", "head"}, false, "is on two"});
  }
  const Findings found = watch::examine_hosts(hosts);
  EXPECT_THAT(codes_of(found), ElementsAre("link-waits", "port-on-two-hosts", "source-on-two-hosts",
                                           "shared-host-name"));
  EXPECT_THAT(found[0].what, HasSubstr("eth7"));
  EXPECT_EQ(found[1].what, "is on two");
}

TEST(Doctor, FindsHostsThatAreGoneWithWhatIsWanted) {
  wire::HostsDocument hosts;
  wire::ImportStatus gone;
  gone.source = "/Planner/speed:o";
  gone.host = "head";
  hosts.imports = {gone};
  EXPECT_THAT(codes_of(watch::examine_hosts(hosts)), ElementsAre("host-gone"));
  EXPECT_THAT(watch::examine_hosts(hosts)[0].what, HasSubstr("head is gone, from which came /Pl"));
  wire::HostStatus head;
  head.host = "head";
  hosts.hosts = {head};
  EXPECT_THAT(codes_of(watch::examine_hosts(hosts)), IsEmpty()) << "it is there, without the port";
}

TEST(Doctor, FindsHostsThatDoNotHearThisOne) {
  wire::HostsDocument hosts;
  wire::HostStatus head;
  head.host = "head";
  head.is_deaf = true;
  hosts.hosts = {head};
  const Findings found = watch::examine_hosts(hosts);
  EXPECT_THAT(codes_of(found), ElementsAre("deaf-host"));
  EXPECT_THAT(found[0].what, HasSubstr("host head is there, and has not heard this one"));
}

TEST(Doctor, LooksForNoOtherHostsWhereNoLinkRuns) {
  EXPECT_THAT(watch::examine_link("no-link-of-this-name"), IsEmpty());
}

TEST(Doctor, FindsNothingOnAMachineThatIsWell) {
  EXPECT_THAT(codes_of(MadeUpMachine().findings()), IsEmpty());
}

TEST(Doctor, FindsNothingWhereItCanReadNothing) {
  const TemporaryDirectory empty;
  EXPECT_THAT(codes_of(watch::examine_machine(watch::Machine(empty.path()))), IsEmpty());
  const MadeUpMachine machine;
  machine.set("proc/self/limits", "Max locked memory\nMax open files     many\n");
  machine.set("proc/meminfo", "MemAvailable:\n");
  EXPECT_THAT(codes_of(machine.findings()), IsEmpty());
}

TEST(Doctor, FindsLimitsThatAreTooLow) {
  const MadeUpMachine machine;
  machine.set("proc/self/limits", limits("8388608", "256", "0"));
  const Findings findings = machine.findings();
  ASSERT_THAT(codes_of(findings), ElementsAre("locked-memory", "realtime-priority", "descriptors"));
  EXPECT_THAT(findings[0].what, HasSubstr("may lock 8192 KiB"));
  EXPECT_THAT(findings[0].mend, HasSubstr("LimitMEMLOCK=infinity"));
  EXPECT_THAT(findings[2].what, HasSubstr("256 descriptors"));
  machine.set("proc/self/limits", limits("67108864", "1024", "1"));
  EXPECT_THAT(codes_of(machine.findings()), IsEmpty()) << "just enough";
}

TEST(Doctor, KnowsWhoNeedsNoLimits) {
  const MadeUpMachine machine;
  machine.set("proc/self/limits", limits("0", "65536", "0"));
  machine.set("proc/self/status", "CapEff:\t0000000000004000\n");
  EXPECT_THAT(codes_of(machine.findings()), ElementsAre("realtime-priority"));
  machine.set("proc/self/status", "CapEff:\t0000000000800000\n");
  EXPECT_THAT(codes_of(machine.findings()), ElementsAre("locked-memory"));
  machine.set("proc/self/status", "CapEff:\t000001ffffffffff\n");
  EXPECT_THAT(codes_of(machine.findings()), IsEmpty());
}

TEST(Doctor, FindsAClockThatTakesASystemCall) {
  const MadeUpMachine machine;
  machine.set(machine.kClock + "current_clocksource", "hpet\n");
  Findings findings = machine.findings();
  ASSERT_THAT(codes_of(findings), ElementsAre("clock-source"));
  EXPECT_THAT(findings[0].mend, HasSubstr("echo tsc > /sys/"));
  machine.set(machine.kClock + "available_clocksource", "hpet acpi_pm\n");
  findings = machine.findings();
  ASSERT_THAT(codes_of(findings), ElementsAre("clock-source"));
  EXPECT_THAT(findings[0].mend, testing::Not(HasSubstr("echo")));
  machine.set(machine.kClock + "current_clocksource", "kvm-clock\n");
  EXPECT_THAT(codes_of(machine.findings()), IsEmpty());
}

TEST(Doctor, FindsGovernorsThatSave) {
  const MadeUpMachine machine;
  machine.set_governor("cpu1", "powersave");
  machine.set_governor("cpu2", "powersave");
  machine.set_governor("cpu3", "schedutil");
  const Findings findings = machine.findings();
  ASSERT_THAT(codes_of(findings), ElementsAre("governor", "governor"));
  EXPECT_THAT(findings[0].what, HasSubstr("of cpu1, cpu2 is powersave"));
  EXPECT_THAT(findings[1].what, HasSubstr("of cpu3 is schedutil"));
}

TEST(Doctor, FindsThatMemoryIsShort) {
  const MadeUpMachine machine;
  machine.set("proc/meminfo", "MemAvailable:    262143 kB\n");
  EXPECT_THAT(codes_of(machine.findings()), ElementsAre("memory"));
  machine.set("proc/meminfo", "MemAvailable:    262144 kB\n");
  EXPECT_THAT(codes_of(machine.findings()), IsEmpty());
}

TEST(Doctor, FindsWhoDiedAndWasNotStartedAgain) {
  const shm::Nanoseconds second = 1'000'000'000;
  wire::Status status;
  status.sources = {{"/o", true, false, second, {}, {}}, {"/p", true, false, second, {}, {}}};
  status.deaths = {{"dead", 44, 1000, 13, {"/o", "/unmentioned"}, {"/gone"}, {}}};
  const Findings findings = watch::examine_deaths(status);
  ASSERT_THAT(codes_of(findings), ElementsAre("dead-component"));
  EXPECT_THAT(findings[0].what, testing::StartsWith("dead (pid 44) died "));
  EXPECT_THAT(findings[0].what, testing::EndsWith(" ago, and nobody has /o open"));
  EXPECT_EQ(findings[0].mend, "start that component again");
  // Of two who had it, the last one is told of.
  status.deaths.push_back({"before", 40, 1000, 12, {"/o", "/p"}, {}, {}});
  EXPECT_THAT(watch::examine_deaths(status)[1].what, testing::EndsWith("nobody has /p open"));
  status.sources[0].active = true;
  status.sources[0].timeout = shm::kForever;
  const Findings for_ever = watch::examine_deaths(status);
  EXPECT_THAT(for_ever[0].why, testing::StartsWith("the activity of /o lasts for ever"));
  EXPECT_THAT(for_ever[0].mend, testing::EndsWith("arbiter deactivate /o"));
  // Whoever had it since has closed it.
  status.deaths[0].opened_since = status.deaths[1].opened_since = {"/o"};
  EXPECT_THAT(codes_of(watch::examine_deaths(status)), ElementsAre("dead-component"));
  EXPECT_THAT(watch::examine_deaths(status)[0].what, testing::EndsWith("nobody has /p open"));
  // Whoever has come in its place, be it away for the moment, is enough.
  status.sources[0].away_pid = 45;
  status.sources[1].open.emplace();
  EXPECT_THAT(watch::examine_deaths(status), IsEmpty());
}

// full_status() has a daemon (42), components (44 and 46), some away (45 and 47), and a stranger.
TEST(Doctor, FindsADaemonWhoseModelWasRefused) {
  wire::Status status;
  status.model.generation = 7;
  EXPECT_THAT(watch::examine_model(status), IsEmpty());
  status.model.refused = {{"a.xml", "b.xml"}, "the model work has errors: b.xml:3:1: no"};
  const Findings findings = watch::examine_model(status);
  ASSERT_THAT(codes_of(findings), ElementsAre("model-refused"));
  EXPECT_EQ(findings[0].what,
            "the files of --model were refused (a.xml, b.xml), so the daemon keeps model 7 of the "
            "last one: the model work has errors: b.xml:3:1: no");
  EXPECT_THAT(findings[0].mend, HasSubstr("arbiter reload"));
}

TEST(Doctor, LooksAtTheProcessesOfTheStatus) {
  const MadeUpMachine machine;
  wire::Status status = full_status();
  const Findings stranger = watch::examine_processes(machine.machine(), status);
  ASSERT_THAT(codes_of(stranger), ElementsAre("no-daemon", "stranger"));
  EXPECT_THAT(stranger[0].what, HasSubstr("with pid 42, is not among its processes"));
  EXPECT_THAT(stranger[1].what, HasSubstr("lost (pid 43, user 1000)"));
  status.strangers.clear();
  machine.set("proc/42/limits", limits("unlimited", "4095", "0"));
  machine.set("proc/42/stat", "42 (arbiterd) S 1\n");
  machine.set("proc/44/stat", "44 (a) ) b) T 1\n");
  machine.set("proc/45/stat", "45 (x) t 1\n");
  machine.set_link("proc/42/exe", "/usr/bin/arbiterd (deleted)");
  machine.set_link("proc/44/exe", "/home/robot/face");
  machine.set_link("proc/self/ns/time", "time:[4026531834]");
  machine.set_link("proc/44/ns/time", "time:[4026531834]");
  machine.set_link("proc/46/ns/time", "time:[4026532000]");
  const Findings findings = watch::examine_processes(machine.machine(), status);
  ASSERT_THAT(codes_of(findings), ElementsAre("daemon-descriptors", "replaced-program", "stopped",
                                              "stopped", "time-namespace"));
  EXPECT_THAT(findings[1].what, HasSubstr("arbiterd (pid 42)"));
  EXPECT_THAT(findings[2].what, HasSubstr("face (pid 44) is stopped"));
  EXPECT_EQ(findings[2].mend, "kill -CONT 44");
  EXPECT_THAT(findings[3].what, HasSubstr("the component of /stop (pid 45)"));
  EXPECT_THAT(findings[4].what, HasSubstr("gaze (pid 46)"));
}

}  // namespace
}  // namespace arbiter::test
