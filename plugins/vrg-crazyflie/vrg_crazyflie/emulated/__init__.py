"""An emulated Crazyflie 2.1 that speaks Bitcraze's protocol CRTP, for trials and tests without a quadrotor."""
