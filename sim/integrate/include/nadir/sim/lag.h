#pragma once

namespace nadir::sim {

/// Share of a change of its input that a lag x' = (u - x)/tau has followed after `duration_s` > 0: 1 - e^(-t/tau),
/// where the time is another each time. `time_constant_s` >= 0. Error: rounding.
double followed_share(double time_constant_s, double duration_s);

/// x' = (u - x)/tau over steps of one length, exactly: no step is too long, and none costs more than three
/// multiplications. Error: rounding.
class FirstOrderLag {
 public:
  /// `time_constant_s` >= 0 (0: the output follows at once), `dt_s` > 0.
  FirstOrderLag(double time_constant_s, double dt_s);

  /// With the input held at `input` over the step.
  double held(double x, double input) const { return x + settled_ * (input - x); }
  /// With the input going from `from` to `to` in a straight line.
  double linear(double x, double from, double to) const { return held(x, from) + ramp_ * (to - from); }

 private:
  double settled_, ramp_;  // what of a step and of a ramp has arrived at the end
};

/// x'' = w^2 (u - x) - 2 z w x' over steps of one length, exactly, whatever the damping z >= 0. Error: rounding.
class SecondOrderLag {
 public:
  struct State {
    double value = 0, rate_per_s = 0;
  };

  /// `frequency_radps` > 0, `damping` >= 0 as a share of critical, `dt_s` > 0.
  SecondOrderLag(double frequency_radps, double damping, double dt_s);

  State held(const State& x, double input) const {
    const double off = x.value - input;
    return {input + value_from_value_ * off + value_from_rate_ * x.rate_per_s,
            rate_from_value_ * off + rate_from_rate_ * x.rate_per_s};
  }
  State linear(const State& x, double from, double to) const {
    State end = held(x, from);
    end.value += ramp_value_ * (to - from);
    end.rate_per_s += ramp_rate_ * (to - from);
    return end;
  }

 private:
  double value_from_value_, value_from_rate_, rate_from_value_, rate_from_rate_;
  double ramp_value_, ramp_rate_;  // at the end of a ramp of 1
};

}  // namespace nadir::sim
