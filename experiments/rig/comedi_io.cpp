#include "experiments/rig/comedi_io.hpp"

#include "core/config/reader.hpp"

#include <cerrno>
#include <cstring>

#include <dlfcn.h>
#include <fmt/format.h>

#if __has_include(<comedilib.h>)
#define SOLENOID_COMEDI 1
#include "experiments/base/files.hpp"

#include <algorithm>
#include <cmath>

#include <comedilib.h>
#endif

namespace solenoid {
namespace {

constexpr const char* library_name = "libcomedi.so.0";

}  // namespace

#ifdef SOLENOID_COMEDI
namespace {

/// The functions used of libcomedi, from whichever library of that name is found first.
struct Library {
  void* handle;
  decltype(&comedi_open) open;
  decltype(&comedi_close) close;
  decltype(&comedi_get_n_channels) get_n_channels;
  decltype(&comedi_get_subdevice_type) get_subdevice_type;
  decltype(&comedi_get_maxdata) get_maxdata;
  decltype(&comedi_get_range) get_range;
  decltype(&comedi_dio_config) dio_config;
  decltype(&comedi_do_insnlist) do_insnlist;
  decltype(&comedi_data_write) data_write;
  decltype(&comedi_dio_bitfield2) dio_bitfield2;

  Library() : handle(::dlopen(library_name, RTLD_NOW | RTLD_LOCAL)) {
    if (!handle) throw ConfigError(fmt::format("{} (allowed: apt-get install libcomedi0)", ::dlerror()));
    load(open, "comedi_open");
    load(close, "comedi_close");
    load(get_n_channels, "comedi_get_n_channels");
    load(get_subdevice_type, "comedi_get_subdevice_type");
    load(get_maxdata, "comedi_get_maxdata");
    load(get_range, "comedi_get_range");
    load(dio_config, "comedi_dio_config");
    load(do_insnlist, "comedi_do_insnlist");
    load(data_write, "comedi_data_write");
    load(dio_bitfield2, "comedi_dio_bitfield2");
  }

 private:
  template <class F>
  void load(F& function, const char* name) {
    void* symbol = ::dlsym(handle, name);
    if (!symbol) throw ConfigError(fmt::format("{} has no {} (allowed: libcomedi 0.11 or later)", library_name, name));
    std::memcpy(&function, &symbol, sizeof symbol);
  }
};

unsigned reference_of(const std::string& name) {
  return name == "diff" ? AREF_DIFF : name == "common" ? AREF_COMMON : AREF_GROUND;
}

class ComediIo final : public RigIo {
 public:
  explicit ComediIo(const ComediSettings& settings) : settings_(settings) {}
  ~ComediIo() override {
    if (!device_) return;
    safe();
    library_.close(device_);
  }
  ComediIo(const ComediIo&) = delete;
  ComediIo& operator=(const ComediIo&) = delete;

  void open() override {
    device_ = library_.open(settings_.device.c_str());
    if (!device_) throw OutputError(fmt::format("{}: cannot be opened: {}", settings_.device, std::strerror(errno)));
    inputs_.clear();
    for (const int channel : settings_.input_channels)
      inputs_.push_back(converter("inputs", settings_.input_subdevice, channel, settings_.input_range));
    outputs_.clear();
    for (const ComediSettings::Output& o : settings_.outputs)
      outputs_.push_back(converter("outputs", o.subdevice, o.channel, o.range));
    prepare_reading();
    prepare_switches();
    write({{}, settings_.safe_switches});
    if (health_.write_errors > 0) throw OutputError(settings_.device + ": refuses the safe outputs");
    health_ = {};
    health_.connected = true;
  }

  RigInputs read() noexcept override {
    ++health_.reads;
    values_.fresh = library_.do_insnlist(device_, &list_) == static_cast<int>(instructions_.size());
    if (!values_.fresh) {
      ++health_.missed;
      return values_;
    }
    for (std::size_t i = 0; i < inputs_.size(); ++i) values_.volts[i] = inputs_[i].volts(samples_[i]);
    return values_;
  }

  void write(const RigOutputs& outputs) noexcept override {
    unsigned bits = digital(outputs.switches);
    watchdog_ = !watchdog_;
    if (settings_.watchdog_channel >= 0 && watchdog_) bits |= 1u << settings_.watchdog_channel;
    put(outputs.volts, bits, digital_mask_);
  }

  /// The watchdog's output stands still: it will trip as well.
  void safe() noexcept override {
    if (device_) put({}, digital(settings_.safe_switches), switch_mask_);
  }

  IoHealth health() const noexcept override { return health_; }

 private:
  /// From numbers to volts and back over the range libcomedi names.
  struct Converter {
    double low = 0, high = 0;
    lsampl_t most = 0;
    double volts(lsampl_t sample) const { return low + (high - low) * sample / most; }
    lsampl_t sample(double v) const {
      const double share = std::clamp((v - low) / (high - low), 0.0, 1.0);
      return static_cast<lsampl_t>(std::lround(share * most));
    }
  };

  Converter converter(const char* what, int subdevice, int channel, int range) {
    const auto sub = static_cast<unsigned>(subdevice), chan = static_cast<unsigned>(channel);
    const int channels = library_.get_n_channels(device_, sub);
    if (channel >= channels)
      throw ConfigError(fmt::format("[comedi] {}: {} has no channel {} in subdevice {} (allowed: below {})", what,
                                    settings_.device, channel, subdevice, channels));
    const comedi_range* volts = library_.get_range(device_, sub, chan, static_cast<unsigned>(range));
    const lsampl_t most = library_.get_maxdata(device_, sub, chan);
    if (!volts || most == 0 || !(volts->max > volts->min))
      throw ConfigError(fmt::format("[comedi] {}: {} has no range {} on channel {} (allowed: one the board lists)",
                                    what, settings_.device, range, channel));
    return {volts->min, volts->max, most};
  }

  void prepare_reading() {
    samples_.assign(inputs_.size(), 0);
    instructions_.assign(inputs_.size(), {});
    for (std::size_t i = 0; i < instructions_.size(); ++i) {
      comedi_insn& in = instructions_[i];
      in.insn = INSN_READ;
      in.n = 1;
      in.data = &samples_[i];
      in.subdev = static_cast<unsigned>(settings_.input_subdevice);
      in.chanspec = CR_PACK(static_cast<unsigned>(settings_.input_channels[i]),
                            static_cast<unsigned>(settings_.input_range), reference_of(settings_.reference));
    }
    list_.n_insns = static_cast<unsigned>(instructions_.size());
    list_.insns = instructions_.data();
  }

  void prepare_switches() {
    const auto sub = static_cast<unsigned>(settings_.digital_subdevice);
    std::vector<int> outputs = settings_.switch_channels;
    for (const int c : outputs) switch_mask_ |= 1u << c;
    digital_mask_ = switch_mask_;
    if (settings_.watchdog_channel >= 0) outputs.push_back(settings_.watchdog_channel);
    if (settings_.watchdog_channel >= 0) digital_mask_ |= 1u << settings_.watchdog_channel;
    const int channels = library_.get_n_channels(device_, sub);
    for (const int channel : outputs) {
      if (channel >= channels)
        throw ConfigError(fmt::format("[comedi] switches: {} has no channel {} in subdevice {} (allowed: below {})",
                                      settings_.device, channel, settings_.digital_subdevice, channels));
      if (library_.get_subdevice_type(device_, sub) == COMEDI_SUBD_DIO &&
          library_.dio_config(device_, sub, static_cast<unsigned>(channel), COMEDI_OUTPUT) < 0)
        throw OutputError(fmt::format("{}: channel {} cannot be an output", settings_.device, channel));
    }
  }

  unsigned digital(SwitchPattern switches) const noexcept {
    unsigned bits = 0;
    for (std::size_t c = 0; c < settings_.switch_channels.size(); ++c)
      if ((switches >> c) & 1u) bits |= 1u << settings_.switch_channels[c];
    return bits;
  }

  void put(const ContinuousValues& volts, unsigned bits, unsigned mask) noexcept {
    bool done =
        library_.dio_bitfield2(device_, static_cast<unsigned>(settings_.digital_subdevice), mask, &bits, 0) >= 0;
    for (std::size_t i = 0; i < outputs_.size(); ++i) {
      const ComediSettings::Output& to = settings_.outputs[i];
      const int written =
          library_.data_write(device_, static_cast<unsigned>(to.subdevice), static_cast<unsigned>(to.channel),
                              static_cast<unsigned>(to.range), AREF_GROUND, outputs_[i].sample(volts[i]));
      done = done && written == 1;
    }
    if (!done) ++health_.write_errors;
  }

  ComediSettings settings_;
  Library library_;
  comedi_t* device_ = nullptr;
  std::vector<Converter> inputs_, outputs_;
  std::vector<lsampl_t> samples_;
  std::vector<comedi_insn> instructions_;
  comedi_insnlist list_{};
  unsigned switch_mask_ = 0, digital_mask_ = 0;
  bool watchdog_ = false;
  RigInputs values_;
  IoHealth health_;
};

}  // namespace

std::unique_ptr<RigIo> make_comedi_io(const ComediSettings& settings) { return std::make_unique<ComediIo>(settings); }

#else

std::unique_ptr<RigIo> make_comedi_io(const ComediSettings&) {
  throw ConfigError(
      "--plant comedi: built without libcomedi (allowed: apt-get install libcomedi-dev, then build again)");
}

#endif

ComediSupport comedi_support() {
  ComediSupport support;
#ifdef SOLENOID_COMEDI
  support.built = true;
#endif
  if (void* handle = ::dlopen(library_name, RTLD_NOW | RTLD_LOCAL)) {
    support.library = true;
    ::dlclose(handle);
  }
  support.detail = !support.built     ? "built without it: apt-get install libcomedi-dev, then build again"
                   : !support.library ? "not installed: apt-get install libcomedi0"
                                      : "driver built, library found";
  return support;
}

}  // namespace solenoid
