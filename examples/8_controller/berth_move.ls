/PROG  BERTHMOV
/ATTR
OWNER           = MNEDITOR;
COMMENT         = "Berth: motion";
PROTECT         = READ_WRITE;
TCD:  STACK_SIZE        = 0,
      TASK_PRIORITY     = 50,
      TIME_SLICE        = 0,
      BUSY_LAMP_OFF     = 0,
      ABORT_REQUEST     = 0,
      PAUSE_REQUEST     = 0;
DEFAULT_GROUP   = 1,*,*,*,*;
CONTROL_CODE    = 00000000 00000000;
/APPL
/MN
   1:  !SPDX-License-Identifier: ;
   2:  !BSD-3-Clause ;
   3:  !Not run on a controller by us. ;
   4:  !Follows PR[1] while told to. ;
   5:   ;
   6:  UFRAME_NUM=0 ;
   7:  UTOOL_NUM=0 ;
   8:   ;
   9:  LBL[1] ;
  10:  IF R[32:command]<>1,JMP LBL[2] ;
  11:  IF R[36:mode]<>1,JMP LBL[2] ;
  12:J PR[1:setpoint] R[34:speed_limit]% CNT100 ;
  13:  JMP LBL[1] ;
  14:   ;
  15:  !To stand ;
  16:  LBL[2] ;
  17:  WAIT    .01(sec) ;
  18:  JMP LBL[1] ;
/POS
/END
