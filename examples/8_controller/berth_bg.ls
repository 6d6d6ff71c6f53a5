/PROG  BERTHBG
/ATTR
OWNER           = MNEDITOR;
COMMENT         = "Berth: status";
PROTECT         = READ_WRITE;
TCD:  STACK_SIZE        = 0,
      TASK_PRIORITY     = 50,
      TIME_SLICE        = 0,
      BUSY_LAMP_OFF     = 0,
      ABORT_REQUEST     = 0,
      PAUSE_REQUEST     = 0;
DEFAULT_GROUP   = *,*,*,*,*;
CONTROL_CODE    = 00000000 00000000;
/APPL
/MN
   1:  !SPDX-License-Identifier: ;
   2:  !BSD-3-Clause ;
   3:  !Not run on a controller by us. ;
   4:  !Background logic, each 8 ms. ;
   5:  !Registers: ;
   6:  !config/registers/snpx.yaml ;
   7:   ;
   8:  !Clock, ms, and heartbeat ;
   9:  R[1:tick]=((R[1:tick]+8) MOD 16777216) ;
  10:  R[2:heartbeat]=((R[2:heartbeat]+1) MOD 16777216) ;
  11:   ;
  12:  !The set-point that has come ;
  13:  R[3:setpoint_taken]=(R[31:setpoint_sequenc]) ;
  14:   ;
  15:  !Idle, running, held, fault, ;
  16:  !emergency stop. Made apart: ;
  17:  !a read may come in between ;
  18:  R[10:spare state]=(1) ;
  19:  IF (UO[4:PAUSED] OR UO[5:HELD]),R[10:spare state]=(3) ;
  20:  IF (UO[3:PROGRUN]),R[10:spare state]=(2) ;
  21:  IF (UO[6:FAULT]),R[10:spare state]=(4) ;
  22:  IF (!UI[1:*IMSTP] OR !UI[3:*SFSPD]),R[10:spare state]=(5) ;
  23:  R[4:state]=(R[10:spare state]) ;
  24:   ;
  25:  R[5:override]=($MCR.$GENOVERRIDE) ;
  26:  R[6:tcp_speed]=(0) ;
  27:   ;
  28:  !How old the host's sign is, ms ;
  29:  R[11:spare host age]=(R[9:spare host age]+8) ;
  30:  IF (R[33:host_heartbeat]<>R[8:spare host seen]),R[11:spare host age]=(0) ;
  31:  R[8:spare host seen]=(R[33:host_heartbeat]) ;
  32:  R[9:spare host age]=(R[11:spare host age]) ;
  33:   ;
  34:  !Until it runs again: 101, the ;
  35:  !host fell silent; 1, an alarm ;
  36:  R[12:spare error]=(R[7:error]) ;
  37:  IF (UO[3:PROGRUN]),R[12:spare error]=(0) ;
  38:  IF (UO[3:PROGRUN] AND R[9:spare host age]>150),R[12:spare error]=(101) ;
  39:  IF (UO[6:FAULT]),R[12:spare error]=(1) ;
  40:  IF (!UO[6:FAULT] AND R[12:spare error]=1),R[12:spare error]=(0) ;
  41:  IF (DO[5:reset]),R[12:spare error]=(0) ;
  42:  R[7:error]=(R[12:spare error]) ;
  43:   ;
  44:  !UI[1-8] are F[1-8] (rack 34). ;
  45:  !*HOLD is active when OFF ;
  46:  F[1:*IMSTP]=(ON) ;
  47:  F[2:*HOLD]=(!DO[4:hold] AND R[9:spare host age]<=150) ;
  48:  F[3:*SFSPD]=(ON) ;
  49:  F[4:CSTOPI]=(OFF) ;
  50:  F[5:FAULT_RESET]=(DO[5:reset]) ;
  51:  F[6:START]=(DO[3:start] AND R[9:spare host age]<=150) ;
  52:  F[8:ENBL]=(ON) ;
/POS
/END
