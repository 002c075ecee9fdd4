//! What the diagnosis says of whole cases, in one program: its tests share the cores to the end, and it is linked once.

mod alias;
mod alike;
mod between;
mod chips;
mod codes;
mod cores;
mod golden;
mod gross;
mod gyros;
mod injected;
mod known;
mod line;
mod logs;
mod marinho;
mod parity;
mod phases;
mod plate;
mod practice;
mod reference;
mod rocket;
mod rooms;
mod seen;
mod several;
mod together;
mod twin_case;
mod written;
