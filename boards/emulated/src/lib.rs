//! The firmware image on an emulated STM32F4, with the twin's parts on its buses.
