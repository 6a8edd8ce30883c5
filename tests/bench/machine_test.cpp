// The machine, read from files of a machine that there is not.
#include "bench/harness/machine.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "bench/harness/program.hpp"

namespace arbiter::bench {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class MachineTest : public testing::Test {
 protected:
  MachineTest() {
    put("/proc/cpuinfo",
        "processor\t: 0\nmodel name\t: Robot PC 9000\nflags\t\t: fpu tsc hypervisors\n\n"
        "processor\t: 1\nmodel name\t: Robot PC 9000\n");
    put("/proc/stat", "cpu  1000 200 300 5000 100 40 60 700 900 900\ncpu0 1 2 3 4 5 6 7 8 0 0\n");
    put("/proc/loadavg", "0.25 0.50 0.75 1/100 4242\n");
    put("/proc/sys/kernel/osrelease", "6.1.0-rt\n");
    put("/sys/devices/system/cpu/online", "0-3\n");
    put("/sys/devices/system/cpu/isolated", "2-3\n");
    put("/sys/devices/system/cpu/nohz_full", "\n");
    put("/sys/devices/system/cpu/smt/active", "0\n");
    put("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n");
    put("/sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n");
    put("/sys/kernel/mm/transparent_hugepage/enabled", "always [madvise] never\n");
  }

  void put(const std::string& path, const std::string& text) const {
    const std::string file = root_.path() + path;
    std::filesystem::create_directories(std::filesystem::path(file).parent_path());
    std::ofstream(file) << text;
  }
  [[nodiscard]] Machine machine() const { return Machine(root_.path()); }

 private:
  ScratchDirectory root_;
};

TEST_F(MachineTest, IsDescribed) {
  const nlohmann::json facts = machine().describe();
  EXPECT_EQ(facts["processor"], "Robot PC 9000");
  EXPECT_EQ(facts["processors"], 4);
  EXPECT_EQ(facts["SMT"], "off");
  EXPECT_EQ(facts["virtualised"], "none");
  EXPECT_EQ(facts["kernel"], "6.1.0-rt");
  EXPECT_EQ(facts["clock source"], "tsc");
  EXPECT_EQ(facts["governor"], "performance");
  EXPECT_EQ(facts["isolated processors"], "2-3");
  EXPECT_EQ(facts["nohz_full"], "none");
  EXPECT_EQ(facts["transparent hugepages"], "madvise");
  EXPECT_EQ(machine().load(), 0.25);
}

TEST_F(MachineTest, OneAsItShouldBeIsNotWarnedOf) { EXPECT_THAT(machine().warnings(), IsEmpty()); }

TEST_F(MachineTest, AVirtualOneIsNamedAndWarnedOf) {
  put("/proc/cpuinfo", "flags\t\t: fpu hypervisor tsc\n");
  put("/sys/class/dmi/id/sys_vendor", "QEMU\n");
  put("/sys/class/dmi/id/product_name", "Standard PC\n");
  EXPECT_EQ(machine().describe()["virtualised"], "virtual machine (QEMU Standard PC)");
  EXPECT_THAT(machine().warnings(), ElementsAre(HasSubstr("virtual machine")));
}

TEST_F(MachineTest, AGovernorThatSavesPowerIsWarnedOf) {
  put("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave\n");
  EXPECT_THAT(machine().warnings(), ElementsAre(HasSubstr("powersave")));
}

TEST_F(MachineTest, ASlowClockIsWarnedOf) {
  put("/sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet\n");
  EXPECT_THAT(machine().warnings(), ElementsAre(HasSubstr("hpet")));
}

TEST_F(MachineTest, OneProcessorIsWarnedOf) {
  put("/sys/devices/system/cpu/online", "0\n");
  EXPECT_THAT(machine().warnings(), ElementsAre(HasSubstr("One processor")));
}

TEST(Machine, ThatSaysNothingIsStillDescribed) {
  const ScratchDirectory empty;
  const nlohmann::json facts = Machine(empty.path()).describe();
  EXPECT_EQ(facts["processor"], "unknown");
  EXPECT_EQ(facts["isolated processors"], "none");
}

TEST(Machine, ListsOfProcessorsAreCounted) {
  EXPECT_EQ(Machine::processors_in(""), 0);
  EXPECT_EQ(Machine::processors_in("0"), 1);
  EXPECT_EQ(Machine::processors_in("0-3"), 4);
  EXPECT_EQ(Machine::processors_in("0-1,4,6-7"), 5);
}

TEST_F(MachineTest, ProcessorTimeIsThatOfAllProcessors) {
  const auto per_second = static_cast<double>(::sysconf(_SC_CLK_TCK));
  const ProcessorTime time = machine().processor_time();
  EXPECT_DOUBLE_EQ(time.busy_s, (1000 + 200 + 300 + 40 + 60) / per_second)
      << "guests are in the users' time already";
  EXPECT_DOUBLE_EQ(time.steal_s, 700 / per_second);
  EXPECT_DOUBLE_EQ(time.total_s, (1600 + 700 + 5100) / per_second);
}

TEST(Sharing, WhatIsNotOursIsTheOthers) {
  const Sharing shared = sharing({10, 1, 100}, {60, 3, 200}, 30);
  EXPECT_DOUBLE_EQ(shared.others, 0.2);
  EXPECT_DOUBLE_EQ(shared.steal, 0.02);
  EXPECT_THAT(warnings_of(shared),
              ElementsAre(AllOf(HasSubstr("Noisy"), HasSubstr("20.0 %")), HasSubstr("2.0 %")));
}

TEST(Sharing, OfAQuietMachineIsNotWarnedOf) {
  EXPECT_THAT(warnings_of(sharing({10, 1, 100}, {42, 1.4, 200}, 30)), IsEmpty());
  // Ticks are coarse: our own time may seem more than all.
  EXPECT_EQ(sharing({10, 1, 100}, {39, 1, 200}, 30).others, 0);
  EXPECT_EQ(sharing({10, 1, 100}, {10, 1, 100}, 0).others, 0) << "no time has passed";
}

TEST(MachineWatch, SaysWhatTheRunWasOf) {
  const MachineWatch watch;
  std::vector<std::string> warnings;
  const nlohmann::json facts = watch.finish(warnings);
  for (const char* const key : {"date", "processor", "usable processors", "load before", "stolen",
                                "used by others", "SCHED_FIFO", "arbiter", "compiler", "build"}) {
    EXPECT_TRUE(facts.contains(key)) << key;
  }
  EXPECT_THAT(facts["arbiter"].get<std::string>(), HasSubstr(ARBITER_TEST_VERSION));
  EXPECT_THAT(facts["libraries"].get<std::vector<std::string>>(),
              Contains(testing::StartsWith("glibc")));
}

}  // namespace
}  // namespace arbiter::bench
